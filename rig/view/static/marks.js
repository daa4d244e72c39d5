// Points, lines, extensometers and gauges: drawn on the image, read by the server, listed with their values.

import { Curves, short, withSigma } from "./curves.js";
import { MARKS } from "./colours.js";
import { moved } from "./grid.js";
import { post } from "./server.js";
import { fieldNow, find, result, state } from "./state.js";
import { make } from "./parts.js";

const MICRO = 1e6;
let turn = 0;
let after = () => {};

const charts = {
  extensometer: new Curves(find("lengths-chart"), (time) => after(frameAt(time))),
  point: new Curves(find("points-chart"), (time) => after(frameAt(time))),
  line: new Curves(find("lines-chart")),
  gauge: new Curves(find("gauges-chart"), (time) => after(frameAt(time))),
};

export function onPick(act) { after = act; }

function frameAt(time) {
  const { values } = result().axis;
  return values.reduce((best, value, n) => (Math.abs(value - time) < Math.abs(values[best] - time) ? n : best), 0);
}

const number = (value) => (value === null ? NaN : value);

export function addMark(kind, ends, name = null) {
  const used = new Set(state.marks.map((mark) => mark.colour));
  const colour = MARKS.find((one) => !used.has(one)) ?? MARKS[turn++ % MARKS.length];
  const letter = { point: "P", line: "L", extensometer: "E", gauge: "G" }[kind];
  let count = 1;
  while (state.marks.some((mark) => mark.name === `${letter}${count}`)) count++;
  const mark = { kind, ends, colour, name: name ?? `${letter}${count}`, curve: null, now: null };
  state.marks.push(mark);
  state.chosen = mark;
  return mark;
}

export function removeMark(mark) {
  state.marks = state.marks.filter((one) => one !== mark);
  if (state.chosen === mark) state.chosen = null;
  showMarks();
}

// Corners of a rectangle between two of them.
export const rectangle = ([left, top], [right, bottom]) => [[left, top], [right, top], [right, bottom], [left, bottom]];

const isGauge = (mark) => mark.kind === "gauge", isLength = (mark) => mark.kind === "extensometer";
export const isReading = (mark) => isGauge(mark) || isLength(mark);
export const readings = (marks = state.marks) => ({
  extensometer: marks.filter(isLength).map(({ name, ends: [start, end] }) => ({ name, start, end })),
  gauge: marks.filter(isGauge).map(({ name, ends }) => ({ name, points: ends })),
});
export const askedFor = (mark, frame) => ({ field: state.field, ends: mark.ends.flat(), frame });

// What gauges read: the strain that is shown, or the first one where none is.
const strainNow = () => result().fields.find(({ name }) => name === (result().strains.includes(state.field) ? state.field : result().strains[0]));
const fieldOf = (mark) => (isLength(mark) ? { factor: MICRO, unit: "µε" } : isGauge(mark) ? strainNow() : fieldNow());

async function read(mark, frame) {
  const name = isGauge(mark) ? `${mark.name}_${strainNow().name}` : mark.name;
  return (await post("readings", { ...readings([mark]), frame }))[name];
}

// Read one frame of a mark: while it is dragged no more than this is asked for, one at a time.
async function readNow(mark) {
  if (isReading(mark)) {
    const { values, sigma } = await read(mark, state.frame);
    return [number(values[0]), number(sigma[0])];
  }
  const { values, sigma } = await post("line", askedFor(mark, state.frame));
  return [number(values[0][0]), number(sigma[0][0])];
}

async function readCurve(mark) {
  const { factor } = fieldOf(mark), times = (list) => list.map((value) => number(value) * factor);
  if (isReading(mark)) {
    const { values, sigma } = await read(mark, null);
    return { x: result().axis.values, y: times(values), s: times(sigma) };
  }
  if (mark.kind === "line") {
    const { distance, values, sigma } = await post("line", askedFor(mark, state.frame));
    return { x: distance.map(number), y: times(values[0]), s: times(sigma[0]) };
  }
  const { values, sigma } = await post("line", askedFor(mark, null));
  return { x: result().axis.values, y: times(values.map((row) => row[0])), s: times(sigma.map((row) => row[0])) };
}

let busy = false;
export async function followMark(mark) {
  if (!result() || busy || mark.kind === "line") return;
  busy = true;
  try {
    const { factor } = fieldOf(mark), [value, sigma] = await readNow(mark);
    mark.now = [value * factor, sigma * factor];
    mark.lost = "";
    showMarks();
  } catch (error) {
    mark.lost = error.message;
    mark.now = null;
  }
  busy = false;
}

// Read the curves of some marks anew.
export async function readMarks(which = () => true) {
  if (!result()) return showMarks();
  await Promise.all(state.marks.filter(which).map(async (mark) => {
    const asked = JSON.stringify([mark.ends, state.field, state.frame]);
    mark.asked = asked;
    try {
      const curve = await readCurve(mark);
      if (mark.asked === asked) Object.assign(mark, { curve, lost: "" });
    } catch (error) {
      Object.assign(mark, { curve: null, lost: error.message });
    }
  }));
  showMarks();
}

function valueNow(mark) {
  if (mark.now) return mark.now;
  if (!mark.curve || mark.kind === "line") return null;
  return [mark.curve.y[state.frame], mark.curve.s[state.frame]];
}

export function wordsOf(mark) {
  const found = result() && valueNow(mark);
  return found ? `${withSigma(...found)} ${fieldOf(mark).unit}` : "";
}

export function showMarks() {
  find("marks-card").hidden = !state.marks.length;
  const rows = find("marks").children;
  if (rows.length !== state.marks.length || state.marks.some((mark, i) => rows[i].mark !== mark)) {
    find("marks").replaceChildren(...state.marks.map(row));
  }
  for (const line of find("marks").children) {
    const { mark } = line, input = line.querySelector("input"), output = line.querySelector("output");
    line.classList.toggle("chosen", mark === state.chosen);
    if (document.activeElement !== input) input.value = ends(mark);
    output.textContent = mark.lost ? "not on the points" : wordsOf(mark) || (mark.curve && mark.kind === "line" ? `${short(mark.curve.x.at(-1))} ${result().length}` : "");
    output.title = mark.lost ?? "";
  }
  showCharts();
  for (const [file, kinds] of [["readings", ["extensometer", "gauge"]], ["point", ["point"]], ["line", ["line"]]]) {
    const none = !result() || !state.marks.some((mark) => kinds.includes(mark.kind));
    for (const end of ["csv", "png"]) document.querySelector(`[data-file="${file}.${end}"]`).disabled = none;
  }
}

function ends(mark) {
  const text = mark.ends.map((place) => place.map((x) => +x.toFixed(1)).join(", "));
  return mark.kind === "point" ? text[0] : text.join(" → ");
}

// Places (x, y) of numbers that were typed for a mark; null where they are not as many as it has.
function typed(mark, text) {
  const found = text.split(/[^\d.+-]+/).filter(Boolean).map(Number), places = [];
  while (found.length > 1) places.push(found.splice(0, 2));
  const fits = isGauge(mark) ? places.length > 2 : places.length === (mark.kind === "point" ? 1 : 2);
  if (!fits || found.length || !places.flat().every(Number.isFinite)) return null;
  return mark.kind === "point" ? [places[0], places[0].slice()] : places;
}

function row(mark) {
  const input = make("input", { type: "text", value: ends(mark), spellcheck: false });
  input.setAttribute("aria-label", `Ends of ${mark.name}, px`);
  input.addEventListener("change", () => {
    const found = typed(mark, input.value);
    if (found) {
      mark.ends = found;
      mark.now = null;
      readMarks((one) => one === mark);
    }
    input.blur();
    showMarks();
  });
  const remove = make("button", { type: "button", title: "Remove (Delete)" }, "×");
  remove.setAttribute("aria-label", `Remove ${mark.name}`);
  remove.addEventListener("click", () => removeMark(mark));
  const dot = make("i");
  dot.style.background = mark.colour;
  const line = make("li", { mark }, dot, make("span", { title: mark.kind }, mark.name), input, make("output"), remove);
  line.addEventListener("click", () => { state.chosen = mark; showMarks(); });
  return line;
}

function showCharts() {
  const axis = result()?.axis, field = fieldNow();
  for (const [kind, part] of [["extensometer", "lengths"], ["gauge", "gauges"], ["point", "points"], ["line", "lines"]]) {
    const series = state.marks.filter((mark) => mark.kind === kind && mark.curve).map(({ name, colour, curve }) => ({ name, colour, ...curve }));
    find(`${part}-card`).hidden = !series.length;
    if (!series.length) continue;
    const along = kind === "line" ? `distance, ${result().length}` : axis.name;
    if (kind === "point") find("points-title").textContent = `${field.title}, ${field.unit}, ± σ`;
    if (kind === "gauge") find("gauges-title").textContent = `${strainNow().title}, mean, ${strainNow().unit}, ± σ`;
    if (kind === "line") find("lines-title").textContent = `${field.title}, ${field.unit}, ± σ, this frame`;
    charts[kind].show({ series, axis: along, unit: fieldOf({ kind }).unit, at: kind === "line" ? undefined : axis.values[state.frame] });
  }
}

export function redrawCharts() { for (const chart of Object.values(charts)) chart.draw(); }

// Draw the marks; on a frame they stand where the material is.
export function drawMarks(drawing, motion) {
  for (const mark of state.marks) {
    const chosen = mark === state.chosen, at = mark.ends.map((place) => moved(state.grid, motion, place));
    if (mark.kind === "point") drawing.cross(at[0], mark.colour, chosen);
    else {
      drawing.path(at, mark.colour, 2.5, isGauge(mark), isLength(mark) ? [6, 4] : []);
      if (isLength(mark)) drawing.edges(at, mark.colour, chosen);
      else for (const place of at) drawing.handle(place, mark.colour, chosen);
    }
    const words = [mark.name, wordsOf(mark)].filter(Boolean).join("  "), middle = [0, 1].map((i) => at.reduce((sum, place) => sum + place[i] / at.length, 0));
    drawing.write(words, mark.kind === "point" ? at[0] : middle, [mark.kind === "point" ? 12 : 0, isGauge(mark) ? 0 : -14], mark.kind === "point" ? "left" : "center");
  }
}
