// The page: asks for a frame, draws it, asks for the next. What it shows is always the newest.

import { Limit, paintRamp } from "./colour.js";
import { FrameView, component, inverse, strainAt, through } from "./frame_view.js";
import { Chart } from "./chart.js";
import { ask as wish } from "./ask.js";
import { showControls } from "./controls.js";
import { show, showBar, showBase, showFigures, showSigns, showStages, showTouches, tapText } from "./panels.js";

const RECONNECT = 1000, STALE = 1500, FIGURES = 125;  // ms
const KEYS = { 0: "none", 1: "exx", x: "exx", 2: "eyy", y: "eyy", 3: "exy", s: "exy" };

const find = (id) => document.getElementById(id);
const view = new FrameView(find("view-canvas"), find("frame"));
const chart = new Chart(find("chart"));
const limits = { exx: new Limit(), eyy: new Limit(), exy: new Limit() };
const choice = { view: "camera", component: "exx", opacity: 0.55, limit: 1e-5, pin: null };
let charted = "exx";  // component of the strain in the chart: that of the map, or the last one
const draws = [];
let socket, frame, waiting, owed = false, received = 0, figured = 0, pointer = null;

function connect() {
  socket = new WebSocket(`ws://${location.host}/stream`);
  socket.binaryType = "arraybuffer";
  let header = null, parts = [];
  socket.onopen = () => { received = performance.now(); ask(); };
  socket.onmessage = ({ data }) => {
    if (typeof data === "string") [header, parts] = [JSON.parse(data), []];
    else parts.push(data);
    if (header && parts.length === header.parts.length) accept(header, parts);
  };
  socket.onclose = () => {
    document.body.dataset.link = "lost";
    waiting = null;
    setTimeout(connect, RECONNECT);
  };
}

function ask() {
  if (socket.readyState !== WebSocket.OPEN) return;
  owed = false;
  const camera = frame ? `camera:${view.canvas.width}` : "camera";  // no larger than it is shown
  const map = choice.component === "none" && !wantsStrain() ? "" : " strain";
  socket.send(choice.view === "camera" ? camera + map : choice.view);
}

function wantsStrain() { return choice.pin !== null && chart.quantity === "strain"; }

// Strain of the charted component and its sigma at the pinned point; null where there is none.
function strainAtPin() {
  const strain = choice.pin && strainAt(frame, ...through(frame.T_px_plate, ...choice.pin));
  if (!strain) return null;
  const number = ["exx", "eyy", "exy"].indexOf(charted);
  return Number.isNaN(strain[number]) ? null : [strain[number], frame.strain.sigma[number] ?? 0];
}

async function accept(header, parts) {
  received = performance.now();
  const part = Object.fromEntries(header.parts.map((name, i) => [name, parts[i]]));
  const decode = (data) => data && createImageBitmap(new Blob([data], { type: "image/jpeg" }));
  if (waiting) owed = true;  // a hidden page does not draw, and then does not ask either
  else ask();
  const [cameraBitmap, projectorBitmap] = await Promise.all([decode(part.camera), decode(part.projector)]);
  const values = part.strain && new Float32Array(part.strain);
  const newest = waiting ?? frame, late = newest ? newest.captured - header.captured : 0;
  if (late > 0 && late < RECONNECT / 1000) return;  // a later one was ready first
  waiting = { ...header, cameraBitmap, projectorBitmap, values };
  if (!document.hidden) draw();  // at once: waiting for a turn to draw makes it 8 ms older
}

function draw() {
  if (!waiting) return;
  frame?.cameraBitmap?.close();
  frame?.projectorBitmap?.close();
  [frame, waiting] = [waiting, null];
  if (owed) ask();
  chart.add(frame, strainAtPin());
  redraw();
  const now = performance.now();
  draws.push(now);
  while (draws[0] < now - 2000) draws.shift();
  document.body.dataset.link = "live";
  document.body.dataset.drawn = frame.captured;  // for who measures how old a frame is
  if (now - figured > FIGURES) showAll(now);
}

function redraw() {
  if (!frame) return;
  const values = component(frame, choice.component);
  if (values) {
    const sigma = frame.strain.sigma[["exx", "eyy", "exy"].indexOf(choice.component)] ?? 0;
    choice.limit = limits[choice.component].follow(values, sigma, frame.captured);
  }
  view.draw(frame, choice);
  showProbe();
}

function showAll(now) {
  figured = now;
  const span = now - draws[0];
  showFigures(frame, span > 500 ? (draws.length - 1) / span * 1000 : null);
  showSigns(frame);
  showBase(frame);
  showTouches(frame);
  showStages(frame);
  showControls(frame);
  showBar(frame, choice);
  showChart();
  const gesture = frame.gestures?.at(-1), tap = frame.taps?.at(-1);
  show("status", [frame.status, gesture?.kind, tap && tapText(tap)].filter(Boolean).join(" · "));
  for (const input of document.querySelectorAll("[name=component]")) input.disabled = !frame.strain;
  find("view").querySelector("[value=projector]").disabled = !frame.projector;
}

function showChart() {
  const pinned = choice.pin ? `at ${choice.pin[0].toFixed(1)}, ${choice.pin[1].toFixed(1)} mm` : "click on the plate to pin a point";
  show("chart-unit", chart.unit);
  show("chart-note", chart.quantity === "strain" ? `; E${charted.slice(1)} ${pinned}` : "; true in grey");
  chart.draw();
}

function showProbe() {
  const probe = find("probe");
  probe.hidden = !pointer || choice.view === "projector";
  if (probe.hidden) return;
  const [px, py] = pointer, [x, y] = through(inverse(frame.T_px_plate), px, py);
  const strain = strainAt(frame, px, py);
  const micro = (value) => (Number.isNaN(value) ? "–" : (value * 1e6).toFixed(0));
  const tail = strain ? `    Exx ${micro(strain[0])}   Eyy ${micro(strain[1])}   Exy ${micro(strain[2])} µε` : "";
  show("probe", `x ${x.toFixed(1)}   y ${y.toFixed(1)} mm${tail}`);
}

function watch() {
  const quiet = performance.now() - received, { dataset } = document.body;
  if (dataset.link === "live" && quiet > STALE && !waiting) dataset.link = "stale";
  const seconds = Math.round(quiet / 1000);
  const [name, title, detail] = {
    live: ["live"],
    waiting: ["connecting", "Waiting for the first frame", "The loop has not published one yet"],
    stale: frame?.fresh === false
      ? ["getting ready", "The loop is at work", `${frame.status}, for ${seconds} s`]
      : ["no new frames", "No new frame", `The last one came ${seconds} s ago; the loop or its camera stands still`],
    lost: ["disconnected", "The loop has stopped", "This page connects again by itself when it runs"],
  }[dataset.link];
  show("link", name);
  find("notice").hidden = !title;
  find("notice").children[0].textContent = title ?? "";
  find("notice").children[1].textContent = detail ?? "";
}

function choose(name, value) {
  const input = document.querySelector(`[name=${name}][value=${value}]`);
  if (!input || input.disabled) return;
  input.checked = true;
  choice[name] = value;
  if (name === "component" && value !== "none" && value !== charted) {
    charted = value;
    chart.forgetStrain();
  }
  redraw();
  if (frame) showBar(frame, choice);
}

for (const name of ["view", "component"]) {
  find(name).addEventListener("change", ({ target }) => choose(name, target.value));
}
find("quantity").addEventListener("change", ({ target }) => { chart.quantity = target.value; showChart(); });
find("view-canvas").addEventListener("click", (event) => {
  if (!frame || choice.view === "projector") return;
  const place = through(inverse(frame.T_px_plate), ...view.toImage(event));
  const inside = place.every((at, i) => at >= 0 && at <= frame.plate[i]);
  choice.pin = inside ? place : null;  // beside the plate it is taken away
  chart.forgetStrain();
  redraw();
  showChart();
});
find("opacity").addEventListener("input", ({ target }) => { choice.opacity = target.value / 100; redraw(); });
document.addEventListener("keydown", (event) => {
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select, [type=number]")) return;
  const key = event.key.toLowerCase();
  if (key in KEYS) choose("component", KEYS[key]);
  if (key === "p") choose("view", choice.view === "camera" ? "projector" : "camera");
  if (key === "r" && frame?.recording && frame.controls) wish({ do: "record" });
  if (key === " " && frame?.played && frame.controls && !event.target.matches("button, input")) {
    event.preventDefault();
    wish({ do: "play" });
  }
  if (key === "f" && frame?.controls && typeof frame.table === "string") wish({ do: "snapshot" });
  if (key === "t" && frame?.recording && frame.controls) wish({ do: "tare" });
});
find("view-canvas").addEventListener("pointermove", (event) => { pointer = view.toImage(event); if (frame) showProbe(); });
find("view-canvas").addEventListener("pointerleave", () => { pointer = null; showProbe(); });
new ResizeObserver(redraw).observe(find("frame"));
paintRamp(find("ramp"));
document.addEventListener("visibilitychange", () => { if (!document.hidden) draw(); });
setInterval(watch, 250);
watch();
connect();
