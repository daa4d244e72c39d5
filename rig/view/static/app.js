// The page of a test: a frame, a field over it, marks on it, and what they read.

import { Colours } from "./colours.js";
import { Drawing } from "./drawing.js";
import { exportFile } from "./files.js";
import { addMark, drawMarks, onPick, readMarks, rectangle, redrawCharts, removeMark, showMarks } from "./marks.js";
import { coloured, showKey, showProbe, showStates } from "./legend.js";
import { make } from "./parts.js";
import { closeRegion, watchPointer } from "./pointer.js";
import { getJSON } from "./server.js";
import { follow, openSetup, preview, previewIsShown, showJob } from "./setup.js";
import { drawnNow, fieldNow, find, forget, frames, read, result, state } from "./state.js";

const PACE = 140;  // ms a frame while it plays
const OF_ROI = "#ffd43b";
const TOOLS = { v: "look", p: "point", l: "line", e: "extensometer", g: "gauge", r: "roi" };

const drawing = new Drawing(find("view-canvas"), find("frame"));
let playing = false, turn = 0, waiting = false;

// What is wrong, by who says it: each takes back what it has said and nothing else.
const sentences = new Map();

function said(who, sentence) {
  if (sentence) sentences.set(who, sentence);
  else sentences.delete(who);
  find("complaint").hidden = !sentences.size;
  find("complaint").textContent = [...sentences.values()].at(-1) ?? "";
}

const complain = (sentence) => said("act", sentence);

async function load() {
  state.info = await getJSON("state");
  forget();
  state.frame = result() ? result().frames.length - 1 : 0;
  state.field ??= result()?.fields[0].name ?? null;
  document.body.dataset.mode = result() ? "result" : "images";
  for (const id of ["field-tools", "state-card", "files-card"]) find(id).hidden = !result();
  find("under").hidden = !result() || !state.info.images.length;
  document.querySelector("[name=tool][value=roi]").parentElement.hidden = !state.info.images.length;
  const fields = result()?.fields ?? [];
  find("field").replaceChildren(...fields.map(({ name, title }) => make("option", { value: name, selected: name === state.field }, title)));
  find("setup-title").textContent = `Correlate ${Math.max(state.info.images.length - 1, 0)} frames`;
  find("seek").max = frames().length - 1;
  showJob();
}

async function reload() {
  await load();
  if (state.tool === "roi") chooseTool("look");
  await show();
  await readMarks();
}

// Show a frame. While one is read, no more than the last that was asked for waits.
let pending = null, again = false;

function show(frame = state.frame) {
  state.frame = Math.min(Math.max(frame, 0), frames().length - 1);
  again = true;
  pending ??= showAll();
  return pending;
}

async function showAll() {
  while (again) {
    again = false;
    await showOne();
  }
  pending = null;
}

async function showOne() {
  try {
    const shown = await read();
    if (result()) await limits();
    state.shown = shown;
    said("frame", "");
  } catch (error) {
    said("frame", error.message);
  }
  for (const mark of state.marks) mark.now = null;
  showFrame();
  redraw();
  if (state.marks.some((mark) => mark.kind === "line")) await readMarks((mark) => mark.kind === "line");
  else showMarks();
  redraw();
}

async function limits() {
  const { name } = drawnNow();
  if (!state.limits.has(name)) state.limits.set(name, await getJSON("limits", { name }));
}

// Which reference it is where several images are, and by how much what they scatter by widens σ.
const ofStills = ({ stills, scatter }) => (stills > 1 ? `, reference of ${stills} stills, σ × ${Math.max(...scatter).toFixed(2)}` : "");

function showFrame() {
  const { name, error } = frames()[state.frame];
  find("seek").value = state.frame;
  find("frame-name").textContent = `frame ${state.frame} · ${name}`;
  const { settings } = result() ?? {};
  find("status").textContent = result()
    ? `${result().path} · subset ${settings.subset} px, step ${settings.step} px, ${settings.strain_kind} strain${ofStills(settings)}`
    : `${frames().length} images; draw a ROI, look at the noise floor, correlate`;
  find("notice").hidden = !error;
  find("notice").children[0].textContent = error ? "This frame was left out" : "";
  find("notice").children[1].textContent = error;
  document.body.dataset.frame = state.frame;  // for who waits until it is drawn
  if (result()) showStates();
}

function redraw() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    draw();
  });
}

function draw() {
  const { shown } = state;
  if (!shown) return;
  drawing.begin(shown.image.size);
  drawing.image(shown.image.bitmap);
  if (previewIsShown()) drawPreview();
  else if (result() && state.shown.value) drawField();
  drawRegions();
  drawMarks(drawing, shown.motion ?? null);
  showKey();
  showProbe();
}

// Colours of some values; the same ones as long as values and limits are.
let last = { colours: null };

function painted(values, drawn, name = drawn.name) {
  const limits = state.limits.get(name) ?? [0, 1];
  if (last.values !== values || last.limits !== limits || last.name !== name) {
    last = { values, limits, name, colours: new Colours(drawn).of(values, limits) };
  }
  return last.colours;
}

function drawField() {
  const { shown } = state, values = state.part === "sigma" && shown.sigma ? shown.sigma : shown.value;
  drawing.field(state.grid, painted(values, drawnNow()), state.opacity, shown.motion);
}

function drawPreview() {
  const { grid, sigma, field, subset } = state.preview;
  drawing.field(grid, painted(sigma, field, "preview"), 0.6 * state.opacity);
  const number = state.pointer ? grid.nearest(state.pointer) : -1;
  if (number < 0) return;
  const place = grid.place(number);
  drawing.square(place, subset, "#ffffff");
  drawing.points(grid, [number, number - 1, number + 1, number - grid.columns, number + grid.columns].filter((one) => one >= 0 && one < sigma.length));
}

function drawRegions() {
  if (result() && state.tool !== "roi") return;
  drawing.shade(state.roi);
  for (const { points, hole } of state.roi) {
    drawing.path(points, OF_ROI, 2, true, hole ? [5, 4] : []);
    if (state.tool === "roi") for (const place of points) drawing.handle(place, OF_ROI);
  }
  if (!state.corners.length) return;
  const tail = state.pointer ? [...state.corners, state.pointer] : state.corners;
  drawing.path(tail, OF_ROI, 2, false, [5, 4]);
  for (const place of state.corners) drawing.handle(place, OF_ROI);
}

async function chooseField(name) {
  state.field = name;
  find("field").value = name;
  if (!fieldNow().sigma) choosePart("value", false);
  await show();
  await readMarks((mark) => mark.kind !== "extensometer");
}

function choosePart(part, again = true) {
  state.part = part;
  document.querySelector(`[name=part][value=${part}]`).checked = true;
  if (again) show();
}

function chooseUnder(under) {
  if (find("under").hidden) return;
  state.under = under;
  document.querySelector(`[name=under][value=${under}]`).checked = true;
  show();
}

function chooseTool(tool) {
  state.tool = tool;
  state.corners = [];
  document.body.dataset.tool = tool;
  document.querySelector(`[name=tool][value=${tool}]`).checked = true;
  find("hole-choice").hidden = tool !== "roi";
  redraw();
}

async function play(on = !playing) {
  const mine = ++turn;
  playing = on;
  find("play").textContent = on ? "Pause" : "Play";
  while (playing && mine === turn) {
    const began = performance.now();
    await show(state.frame + 1 < frames().length ? state.frame + 1 : 0);
    await new Promise((done) => setTimeout(done, Math.max(PACE - (performance.now() - began), 0)));
  }
}

function zoom(factor) {
  drawing.zoomAbout(drawing.size.map((length, i) => drawing.middle[i] * length - 0.5), factor);
  redraw();
}

const nextField = (by) => {
  const names = result().fields.map(({ name }) => name);
  return chooseField(names[(names.indexOf(state.field) + by + names.length) % names.length]);
};

// A mark in the middle, for who has no pointer: its ends can be typed.
function place() {
  if (state.tool === "look" || !state.shown) return;
  const [wide, high] = state.shown.image.size.map((length) => length / 2);
  const reach = state.tool === "point" ? 0 : wide / 2, down = state.tool === "gauge" ? high / 2 : 0;
  const ends = [[wide - reach, high - down], [wide + reach, high + down]];
  const mark = addMark(state.tool, state.tool === "gauge" ? rectangle(...ends) : ends);
  readMarks((one) => one === mark).then(redraw);
}

const ACTS = {
  arrowleft: () => show(state.frame - 1), arrowright: () => show(state.frame + 1),
  home: () => show(0), end: () => show(frames().length - 1),
  " ": () => play(), s: () => fieldNow()?.sigma && choosePart(state.part === "sigma" ? "value" : "sigma"),
  f: (event) => result() && nextField(event.shiftKey ? -1 : 1),
  d: () => chooseUnder(state.under === "frame" ? "reference" : "frame"),
  "+": () => zoom(1.4), "=": () => zoom(1.4), "-": () => zoom(1 / 1.4), 0: () => { drawing.fit(); redraw(); },
  enter: () => (state.tool === "roi" ? closeRegion() : place()),
  backspace: () => { state.corners.pop(); redraw(); },
  escape: () => { state.corners = []; state.chosen = null; showMarks(); redraw(); },
  delete: () => { if (state.chosen) removeMark(state.chosen); redraw(); },
  "?": () => find("keys").showModal(),
};

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || find("keys").open) return;
  if (event.target.matches("input:not([type=radio], [type=checkbox], [type=range]), select")) return;
  const key = event.key.toLowerCase();
  const used = event.target.matches("input, button") && [" ", "enter", "arrowleft", "arrowright", "home", "end"].includes(key);
  if (used) return;
  if (key in TOOLS && (key !== "r" || state.info?.images.length)) chooseTool(TOOLS[key]);
  else if (key in ACTS) {
    event.preventDefault();
    ACTS[key](event);
    redraw();
  }
});

find("tool").addEventListener("change", ({ target }) => chooseTool(target.value));
find("part").addEventListener("change", ({ target }) => choosePart(target.value));
find("under").addEventListener("change", ({ target }) => chooseUnder(target.value));
find("field").addEventListener("change", ({ target }) => chooseField(target.value));
find("opacity").addEventListener("input", ({ target }) => { state.opacity = target.value / 100; redraw(); });
find("seek").addEventListener("input", ({ target }) => show(Number(target.value)));
find("play").addEventListener("click", () => play());
find("fit").addEventListener("click", () => { drawing.fit(); redraw(); });
find("help").addEventListener("click", () => find("keys").showModal());
for (const id of ["low", "high"]) {
  find(id).addEventListener("change", () => {
    const [low, high] = [find("low"), find("high")].map((input) => Number(input.value));
    if (low < high) state.limits.set(coloured().name, [low, high]);
    redraw();
  });
}
find("auto-limits").addEventListener("click", async () => {
  state.limits.delete(drawnNow().name);
  await show();
});
find("frame-limits").addEventListener("click", () => {
  const { shown, part } = state, drawn = drawnNow(), values = part === "sigma" && shown.sigma ? shown.sigma : shown.value;
  const known = [...values].filter(Number.isFinite).sort((a, b) => a - b), at = (where) => known[Math.round(where * (known.length - 1))] * drawn.factor;
  if (known.length && at(0.01) < at(0.99)) state.limits.set(drawn.name, [at(0.01), at(0.99)]);
  redraw();
});
find("files-card").addEventListener("click", async ({ target }) => {
  const { file } = target.dataset;
  if (!file) return;
  target.disabled = true;
  try {
    await exportFile(file, drawing);
    complain("");
  } catch (error) {
    complain(error.message);
  }
  target.disabled = false;
});
find("marks").addEventListener("click", redraw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redrawCharts);
new ResizeObserver(() => { redraw(); redrawCharts(); }).observe(find("frame"));

onPick((frame) => show(frame));
watchPointer(drawing, redraw);

async function open() {
  try {
    await load();
    state.roi = state.info.regions.roi;
    for (const { name, start, end } of state.info.regions.extensometer) addMark("extensometer", [start, end], name);
    for (const { name, points } of state.info.regions.gauge) addMark("gauge", points, name);
    state.chosen = null;
    openSetup({
      complain, redraw, reload,
      showReference: () => show(result() ? state.frame : state.info.images.indexOf(find("reference").value)),
    });
    chooseTool("look");
    await show();
    await readMarks();
    if (state.info.images.length) await preview();
    if (state.info.job.running) await follow();
    document.body.dataset.ready = "yes";
  } catch (error) {
    complain(error.message);
  }
}

open();
