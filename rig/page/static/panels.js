// The figures beside the frame. Text is set, never markup, so that no status can inject any.

const GLYPHS = {
  truth: '<circle cx="10" cy="10" r="7.5" class="truth"/>',
  touches: '<circle cx="10" cy="10" r="6" class="pattern"/>',
  from_strain: '<path d="M10 2.5 17.5 10 10 17.5 2.5 10Z" class="strain"/>',
};
const SOURCES = [["touches", "Whole pattern"], ["from_strain", "Strain alone"], ["truth", "True"]];

const UNITS = { mm: [1, "mm", 3], s: [1e3, "ms", 1], fraction: [100, "%", 1] };

export function inUnit(error, unit) {
  const [scale, name, digits] = UNITS[unit];
  return error === null ? "–" : `${(scale * error).toFixed(digits)} ${name}`;
}

export const text = (value, digits) => (value === null || value === undefined ? "–" : value.toFixed(digits));

export function show(id, value) {
  const element = document.getElementById(id);
  if (element.textContent !== value) element.textContent = value;
}

export function make(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

export function showFigures(frame, pageRate) {
  const [position, positionMedian] = frame.position_error, [force, forceMedian] = frame.force_error;
  show("position", text(position, 2));
  show("position-median", text(positionMedian, 2));
  show("force", text(force, 3));
  show("force-median", text(forceMedian, 3));
  show("fps", text(frame.fps, 1));
  show("page-fps", text(pageRate, 0));
  show("dropped", String(frame.dropped));
  show("noise", text(frame.noise, 1));
}

// What warns has a mark and a word for who cannot see the colour.
export function showSigns({ signs }) {
  document.getElementById("quality").hidden = !signs.length;
  document.getElementById("signs").replaceChildren(...signs.map(({ name, says, warns }) =>
    make("div", { className: warns ? "warning" : "", title: warns ? "warning" : "" },
      make("dt", {}, name), make("dd", {}, warns ? `▲ ${says}` : says))));
}

// What a shape is worth that is more than just stable.
const WORTH = {
  STABLE: "",
  NEAR_LIMIT: "whether it stays cannot be known: near a limit",
  OVERSTRAINED: "strained beyond its limit",
};

// Bend and twist of a base, and the shapes that it leaves the plate to rest in.
export function showBase({ base }) {
  document.getElementById("base").hidden = !base;
  if (!base) return;
  show("bend", `${text(base.bend, 3)} ± ${text(base.sigma_bend, 4)} mm`);
  show("twist", `${text(base.twist, 3)} ± ${text(base.sigma_twist, 4)}°`);
  show("stability", [`${text(base.eigenvalue, 2)} of the flat plate`, WORTH[base.verdict]].filter(Boolean).join(", "));
  show("sought", base.all_sought ? "stable shapes, ▸ shown" : "its half turns, others are sought");
  document.getElementById("shapes").replaceChildren(...base.shapes.map(shapeRow));
}

function shapeRow({ name, energy, verdict, shown }) {
  const said = [shown ? `▸ ${name}` : name, WORTH[verdict]].filter(Boolean).join(", ");
  return make("tr", { className: shown ? "whole" : "" }, make("td", {}, said),
    make("td", {}, `${text(energy, 1)} N mm`));
}

export function showTouches(frame) {
  const rows = SOURCES.filter(([source]) => frame[source] !== null).flatMap(([source, name]) => touchRows(frame[source], source, name));
  document.getElementById("touches").replaceChildren(...rows);
  document.getElementById("legend-truth").hidden = frame.truth === null;
  document.getElementById("legend-strain").hidden = frame.from_strain === null;
}

function touchRows(marks, source, name) {
  const shown = marks.length ? marks : [null];
  return shown.map((mark, i) => {
    const row = make("tr", { className: `${i ? "" : "first"} ${i === shown.length - 1 ? "last" : ""}` });
    const label = make("span");
    label.innerHTML = i ? "" : `<svg viewBox="0 0 20 20">${GLYPHS[source]}</svg><b>${name}</b>`;
    row.append(make("td", {}, label), ...(mark ? cells(mark, source === "truth") : [make("td"), make("td"), make("td", { className: "muted" }, "none", make("em"))]));
    return row;
  });
}

function cells(mark, exact) {
  const [a, b, angle] = mark.sigma.map((part) => part ?? NaN), c = Math.cos(angle), s = Math.sin(angle);
  return [
    [mark.x, spread(Math.hypot(a * c, b * s), 2), 1], [mark.y, spread(Math.hypot(a * s, b * c), 2), 1],
    [mark.force, mark.force_interval ? interval(mark.force_interval) : spread(mark.sigma_force, 3), 3],
  ].map(([value, sure, digits]) => make("td", {}, text(value, digits), make("em", {}, exact ? "" : sure)));
}

function spread(sigma, digits) {
  return `± ${text(Number.isNaN(sigma) ? null : sigma, digits)}`;
}

// 95 %, where the force is not known evenly to both sides
function interval([low, high]) {
  return `${text(low, 2)} … ${high === null ? "∞" : text(high, 2)}`;
}

export function tapText({ force, at_least, sigma }) {
  return force === null ? `tap above ${text(at_least, 2)} N` : `tap ${text(force, 2)} ± ${text(sigma[2], 2)} N`;
}

export function showStages(frame) {
  const [median, p95] = frame.latency;
  const full = Math.max(p95 ?? 0, ...frame.stages.map((stage) => stage[2] ?? 0), 1e-9);
  const rows = [...frame.stages, ["capture to touches", median, p95]].map(([name, middle, late]) => {
    const meter = make("div", { className: "meter" }, make("i"), make("i"));
    meter.children[0].style.width = `${100 * (middle ?? 0) / full}%`;
    meter.children[1].style.left = `calc(${100 * (late ?? 0) / full}% - 2px)`;
    meter.children[1].hidden = late === null;
    return make("tr", {}, make("td", {}, name), make("td", {}, meter), make("td", {}, text(middle, 1)), make("td", {}, text(late, 1)));
  });
  rows.at(-1).className = "whole";
  document.getElementById("stages").replaceChildren(...rows);
}

export function showBar(frame, choice) {
  const bar = document.getElementById("bar");
  const hidden = choice.component === "none" || !frame.strain || choice.view === "projector";
  bar.classList.toggle("off", hidden);
  if (hidden) {
    show("bar-note", !frame.strain ? `No strain map: ${frame.strain_reason || "this scene does not compute it"}` : "");
    return;
  }
  const micro = (strain) => +(strain * 1e6).toPrecision(3);
  show("bar-low", `−${micro(choice.limit)}`);
  show("bar-high", `+${micro(choice.limit)} µε`);
  const sigma = frame.strain.sigma[["exx", "eyy", "exy"].indexOf(choice.component)];
  show("bar-note", sigma === null ? "" : `σ ${micro(sigma).toFixed(0)} µε`);
}
