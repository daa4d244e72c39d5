// What stands beside the image: the colours, the value under the pointer, what became of the points.

import { Colours } from "./colours.js";
import { short, withSigma } from "./curves.js";
import { make } from "./parts.js";
import { previewIsShown } from "./setup.js";
import { drawnNow, fieldNow, find, result, state } from "./state.js";

// What the colours over the image mean: a field, or the noise floor of the preview.
export const coloured = () => (previewIsShown() ? { ...state.preview.field, name: "preview" } : result() && drawnNow());

export function showKey() {
  const drawn = coloured();
  find("key").hidden = !drawn;
  if (!drawn) return;
  const [low, high] = state.limits.get(drawn.name) ?? [0, 1], status = drawn.name === "status";
  for (const [id, value] of [["low", low], ["high", high]]) {
    if (document.activeElement !== find(id)) find(id).value = +value.toPrecision(4);
  }
  new Colours(drawn).paintRamp(find("ramp"));
  find("bar").hidden = status;
  find("auto-limits").hidden = find("frame-limits").hidden = drawn.name === "preview";
  find("unit").textContent = drawn.unit;
  find("bar-title").textContent = drawn.title;
  find("legend").hidden = !status;
  for (const input of document.querySelectorAll("[name=part]")) input.disabled = !fieldNow()?.sigma;
  if (status) find("legend").replaceChildren(...counted().map(([one, count]) => make("li", {}, swatch(drawn.colours[one.value]), `${one.name} ${count}`)));
}

function swatch(colour) {
  const dot = make("i");
  dot.style.background = colour;
  return dot;
}

function counted() {
  const counts = new Map();
  for (const value of state.shown?.status ?? []) counts.set(value, (counts.get(value) ?? 0) + 1);
  return state.info.status.map((one) => [one, counts.get(one.value) ?? 0]).filter(([, count]) => count);
}

// What became of the points, in words, the commonest first.
export function showStates() {
  const total = state.shown?.status.length ?? 0, found = counted().sort((a, b) => b[1] - a[1]);
  find("state-title").textContent = `${total} points`;
  find("states").replaceChildren(...found.map(([{ name, sentence }, count]) => make("div", {},
    make("dt", {}, name), make("dd", {}, `${(100 * count / total).toFixed(1)} %`), make("dd", {}, sentence))));
}

export function showProbe() {
  const probe = find("probe"), { pointer } = state;
  probe.hidden = !pointer;
  if (!pointer) return;
  const [x, y] = pointer;
  probe.textContent = `x ${x.toFixed(1)}   y ${y.toFixed(1)} px${previewIsShown() ? expectedAt(pointer) : valueAt(pointer)}`;
}

function expectedAt(place) {
  const { grid, sigma, status, subset } = state.preview, number = grid.nearest(place);
  if (number < 0) return "";
  const value = sigma[number];
  const words = Number.isNaN(value) ? state.info.status.find((one) => one.value === status[number]).name : `σ ${short(1e3 * value)} mpx`;
  return `    ${words}   subset ${subset} px`;
}

function valueAt(place) {
  const { shown, grid } = state, number = grid && shown.value ? grid.nearest(place) : -1;
  if (number < 0) return "";
  const field = fieldNow(), status = state.info.status.find((one) => one.value === shown.status[number]);
  if (field.name === "status") return `    ${status?.name ?? "no frame"}`;
  const value = shown.value[number] * field.factor;
  const words = shown.sigma ? withSigma(value, shown.sigma[number] * field.factor) : short(value);
  return `    ${field.name.replaceAll("_", " ")} ${words} ${field.unit}   ${status?.name ?? "no frame"}`;
}
