// The form of a correlation: a preview of what its settings give, the ROI as a file, and the start.

import { readings } from "./marks.js";
import { PointGrid } from "./grid.js";
import { make, settled } from "./parts.js";
import { getJSON, keep, post, postFor } from "./server.js";
import { beforeName, find, result, state } from "./state.js";

const POLL = 300;  // ms between looks at a correlation that runs
const micro = (value) => (value === null ? "–" : `${+(value * 1e6).toPrecision(3)} µε`);
const milli = (value) => (value === null ? "–" : `${+(value * 1e3).toPrecision(3)} mpx`);

let act = {};  // { complain(sentence), redraw(), reload() }
let asked = "", begun = 0;

export function openSetup(actions) {
  act = actions;
  const { images } = state.info;
  find("setup").hidden = !images.length;
  find("setup").open = !result();
  if (!images.length) return;
  find("reference").replaceChildren(...images.map((name) => make("option", { value: name }, name)));
  askPreview();
}

export const settings = () => ({
  reference: beforeName(),
  subset: Number(find("subset").value), step: Number(find("step").value),
  order: Number(find("order").value), window: Number(find("window").value), kind: find("kind").value,
  scale: find("scale").value.trim(),
  roi: state.roi, ...readings(),
});

export async function preview() {
  if (!find("reference").value) return;
  const wanted = settings(), key = JSON.stringify([wanted.reference, wanted.subset, wanted.step, wanted.order, wanted.window, wanted.kind, wanted.roi]);
  if (key === asked) {
    find("setup-note").textContent = "";
    return;
  }
  asked = key;
  find("setup-note").textContent = "looking…";
  try {
    const found = await post("preview", wanted);
    if (asked !== key) return;
    const sigma = new Float32Array(bytes(found.sigma).buffer), status = new Int8Array(bytes(found.status).buffer);
    state.preview = { ...found, sigma, status, grid: new PointGrid(found), subset: wanted.subset };
    state.limits.set("preview", limitsOf([...sigma]));
    showExpected(found);
    act.complain("");
  } catch (error) {
    if (asked !== key) return;
    state.preview = null;
    find("expected").replaceChildren();
    find("reason").textContent = "";
    act.complain(error.message);
  }
  find("setup-note").textContent = "";
  find("correlate").disabled = !state.preview?.measured || state.info.job.running;
  act.redraw();
}

const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

// Limits between which nearly all values lie.
function limitsOf(values) {
  const known = values.filter(Number.isFinite).sort((a, b) => a - b), at = (part) => known[Math.floor(part * (known.length - 1))];
  return known.length ? [0.9 * at(0.02), 1.3 * at(0.9)] : [0, 1];
}

const later = settled(preview, 200);
export const askPreview = () => { find("setup-note").textContent = "looking…"; later(); };

function showExpected({ points, measured, median, high, strain, gauge, reason }) {
  const rows = [
    ["points", `${measured} of ${points}`], ["gauge length", `${gauge} px`],
    ["noise floor", milli(median)], ["95 % below", milli(high)], ["strain noise", micro(strain)],
  ];
  find("expected").replaceChildren(...rows.map(([name, text]) => make("div", {}, make("dt", {}, name), make("dd", {}, text))));
  find("reason").textContent = reason;
}

async function tried(work) {
  try {
    await work();
    act.complain("");
  } catch (error) {
    find("setup-note").textContent = "";
    act.complain(error.message);
  }
}

export function showJob() {
  const { running, done, total } = state.info.job;
  find("job").hidden = !running;
  find("correlate").disabled = running || !state.preview?.measured;
  Object.assign(find("job-bar"), { max: Math.max(total, 1), value: done });
  const left = done > 1 ? (performance.now() - begun) / done * (total - done) / 1000 : null;
  find("job-note").textContent = total ? `${done} of ${total} frames${left === null ? "" : `, ${Math.ceil(left)} s left`}` : "preparing";
}

export async function follow() {
  const before = state.info.job;
  state.info.job = await getJSON("job");
  const { running, results, error } = state.info.job;
  showJob();
  if (running) setTimeout(() => tried(follow), POLL);
  else if (results > before.results) {
    find("setup").open = false;
    await act.reload();
  }
  else if (error) act.complain(error);
}

find("setup").addEventListener("input", ({ target }) => { if (target.id !== "show-preview") askPreview(); });
find("setup").addEventListener("submit", (event) => event.preventDefault());
find("show-preview").addEventListener("change", () => act.redraw());
find("reference").addEventListener("change", () => act.showReference());
find("scale").addEventListener("focus", ({ target }) => {
  if (!target.value && state.chosen?.kind === "line") target.value = `${state.chosen.ends.flat().map((x) => +x.toFixed(1)).join(",")}=`;
});
find("suggest").addEventListener("click", () => tried(async () => {
  find("setup-note").textContent = "looking…";
  const { subset, step } = await getJSON("recommend", { reference: beforeName() });
  Object.assign(find("subset"), { value: subset });
  Object.assign(find("step"), { value: step });
  askPreview();
}));
find("save-roi").addEventListener("click", () => tried(async () => {
  keep(await (await postFor("regions", settings())).blob(), "regions.toml");
}));
find("clear-roi").addEventListener("click", () => {
  Object.assign(state, { roi: [], corners: [] });
  askPreview();
  act.redraw();
});
find("correlate").addEventListener("click", () => tried(async () => {
  begun = performance.now();
  state.info.job = { ...state.info.job, ...(await post("correlate", settings())) };
  showJob();
  setTimeout(() => tried(follow), POLL);
}));
find("stop").addEventListener("click", () => tried(() => post("stop", {})));

export const previewIsShown = () => Boolean(state.preview) && find("show-preview").checked && (!result() || state.tool === "roi");
