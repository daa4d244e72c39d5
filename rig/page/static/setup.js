// The setup: shows the step of now, and sends what is answered and pressed. Text is set, never markup.

import { ask } from "./ask.js";
import { inUnit, make, show, showSigns } from "./panels.js";

const RECONNECT = 1000;  // ms
const RADIUS = 14, CROSS = 22;  // px of the mark on the image
const find = (id) => document.getElementById(id);
const canvas = find("view-canvas"), histogram = find("histogram");
let socket, turn = 0, finished = false;

function connect() {
  socket = new WebSocket(`ws://${location.host}/stream`);
  socket.binaryType = "arraybuffer";
  let header = null, parts = [];
  socket.onopen = next;
  socket.onmessage = ({ data }) => {
    if (typeof data === "string") [header, parts] = [JSON.parse(data), []];
    else parts.push(data);
    if (header && parts.length === header.parts.length) accept(header, parts);
  };
  socket.onclose = () => {
    link("lost", finished ? "finished" : "disconnected");
    if (finished) {
      show("status", "Setup: all steps are done");
      find("buttons").hidden = true;
      return;
    }
    show("trouble", "the setup was left; the same command goes on from here");
    find("trouble").hidden = false;
    for (const control of document.querySelectorAll("main button, main input, main select")) control.disabled = true;
    for (const part of Object.keys(shown)) delete shown[part];  // all is made anew when it goes on
    setTimeout(connect, RECONNECT);
  };
}

function next() {
  if (socket.readyState === WebSocket.OPEN) socket.send(`camera:${find("stage").clientWidth || 640}`);
}

async function accept(header, parts) {
  const bitmap = parts.length ? await createImageBitmap(new Blob([parts[0]], { type: "image/jpeg" })) : null;
  link("live", "live");
  showSteps(header);
  showStep(header);
  showImage(header, bitmap);
  bitmap?.close();
  const { name, sentence, trouble, buttons } = header.view;
  if (changed("step", name)) scrollTo(0, 0);  // what is to be done stands above
  document.body.dataset.step = name;  // for scripts: which step it is, and how often it has changed
  if (changed("turn", name, sentence, trouble, buttons)) document.body.dataset.turn = ++turn;
  next();
}

function link(state, name) {
  document.body.dataset.link = state;
  show("link", name);
}

const shown = {};  // what each part shows now: it is made anew only where that changes
function changed(name, ...values) {
  const text = JSON.stringify(values);
  if (shown[name] === text) return false;
  shown[name] = text;
  return true;
}

function showSteps({ steps, controls }) {
  if (!changed("steps", steps, controls)) return;
  find("steps").replaceChildren(...steps.map(({ name, title, state, figure }) => {
    const found = figure ? [make("small", {}, figure)] : [];
    const button = make("button", { type: "button", disabled: !controls || state === "closed", value: name }, make("span", {}, title), ...found);
    if (state === "now") button.setAttribute("aria-current", "step");
    button.addEventListener("click", () => ask({ do: "go", step: name }));
    return make("li", { className: state }, button);
  }));
  const done = steps.filter(({ state }) => state === "done").length;
  show("status", `Setup: ${done} of ${steps.length} steps are done`);
}

function showStep({ view, controls }) {
  show("title", view.title);
  show("say", view.sentence);
  show("trouble", view.trouble);
  find("trouble").hidden = !view.trouble;
  showProgress(view);
  showQuestions(view, controls);
  showButtons(view, controls);
  showVerdict(view.verdict);
}

function showProgress({ progress, unit }) {
  find("progress").hidden = !progress;
  const views = progress?.views ?? [];
  if (progress) {
    Object.assign(find("bar"), { max: progress.wanted, value: progress.taken });
    show("taken", `${progress.taken} of ${progress.wanted}`);
    show("error", progress.error === null ? "" : ` · error ${inUnit(progress.error, unit)}`);
  }
  if (!changed("views", views)) return;
  find("views").replaceChildren(...views.map(([number, text]) => {
    const button = make("button", { type: "button", title: "Drop this view" }, "×");
    button.setAttribute("aria-label", `Drop view ${number}`);
    button.addEventListener("click", () => ask({ do: "drop", view: number }));
    return make("li", {}, make("span", {}, `View ${number}`), make("small", {}, text), button);
  }));
}

function showQuestions({ name, questions }, controls) {
  if (!changed("questions", name, questions, controls)) return;
  const focused = document.activeElement?.name;
  find("questions").replaceChildren(...questions.map((question) => {
    const { key, label, value, choices, free } = question;
    const options = choices.map((choice) => make("option", { value: choice, selected: choice === value }, choice));
    const input = options.length && !free ? make("select", { name: key }, ...options) : make("input", { name: key, value });
    const hints = free ? [make("datalist", { id: `${key}-choices` }, ...options)] : [];
    if (free) input.setAttribute("list", `${key}-choices`);
    input.disabled = !controls;
    input.addEventListener("change", () => ask({ do: "answer", key, text: input.value }));
    return make("label", {}, make("span", {}, label), input, ...hints);
  }));
  if (focused) find("form").elements[focused]?.focus();
}

function showButtons({ name, buttons }, controls) {
  if (!changed("buttons", name, buttons, controls)) return;
  find("buttons").replaceChildren(...buttons.map(({ name: button, label, usual }) => {
    const made = make("button", { type: usual ? "submit" : "button", className: usual ? "usual" : "", value: button, disabled: !controls }, label);
    if (!usual) made.addEventListener("click", () => press(button));
    return made;
  }));
}

// What is still being written in a field counts before the button does.
function press(button) {
  document.activeElement?.blur();
  finished = button === "next" && Boolean(find("steps").querySelector(".now:last-child"));
  ask(button === "leave" ? { do: "leave" } : { do: "press", button });
}

find("form").addEventListener("submit", (event) => {
  event.preventDefault();
  const usual = find("buttons").querySelector(".usual");
  if (usual && !usual.disabled) press(usual.value);
});
document.addEventListener("keydown", (event) => {  // Enter goes on wherever the focus is
  if (event.key !== "Enter" || event.target.closest("form, button, a")) return;
  find("form").requestSubmit();
});

function showVerdict(rows) {
  if (!changed("verdict", rows)) return;
  find("verdict").hidden = !rows.length;
  find("verdict").tBodies[0].replaceChildren(...rows.map(({ what, figure, good, advice }) =>
    make("tr", { className: good ? "" : "warning" },
      make("td", {}, what), make("td", {}, good ? figure : `▲ ${figure}`), make("td", { className: "muted" }, advice))));
}

function showImage({ view, size }, bitmap) {
  find("stage").hidden = !bitmap;
  find("quality").hidden = !view.histogram.length;
  if (!bitmap) return;
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
    Object.assign(canvas, { width: bitmap.width, height: bitmap.height });
  }
  const pen = canvas.getContext("2d");
  pen.drawImage(bitmap, 0, 0);
  if (view.mark) drawMark(pen, view.mark.map((part) => (part + 0.5) * bitmap.width / size[0]));
  if (!view.histogram.length) return;
  drawHistogram(view.histogram);
  showSigns(view);
}

function drawMark(pen, [x, y]) {
  for (const [width, colour] of [[5, "#000a"], [2, "#2bd1b0"]]) {
    Object.assign(pen, { lineWidth: width, strokeStyle: colour });
    pen.beginPath();
    pen.arc(x, y, RADIUS, 0, 2 * Math.PI);
    pen.moveTo(x - CROSS, y);
    pen.lineTo(x + CROSS, y);
    pen.moveTo(x, y - CROSS);
    pen.lineTo(x, y + CROSS);
    pen.stroke();
  }
}

function drawHistogram(counts) {
  const pen = histogram.getContext("2d"), style = getComputedStyle(document.body);
  const { width, height } = histogram, step = width / counts.length, highest = Math.max(...counts.slice(1, -1), 1);
  pen.clearRect(0, 0, width, height);
  counts.forEach((count, i) => {
    const edge = i === 0 || i === counts.length - 1;  // what lies there says nothing any more
    pen.fillStyle = style.getPropertyValue(edge ? "--bad" : "--pattern");
    const high = Math.min(count / highest, 1) * (height - 6);
    pen.fillRect(i * step + 1, height - high, step - 2, high);
  });
}

connect();
