// What stands beside the frame: notes, recording, settings, calibration and its wizard. Whoever may
// only look sees all of it and finds the controls off. Text is set, never markup.

import { ask } from "./ask.js";
import { inUnit, make, show } from "./panels.js";

const find = (id) => document.getElementById(id);

const shown = {};  // what each part shows now: it is made anew only where that changes
function changed(name, value) {
  const text = JSON.stringify(value);
  if (shown[name] === text) return false;
  shown[name] = text;
  return true;
}

export function showControls(frame) {
  showNotes(frame);
  showRecording(frame);
  showFiles(frame);
  showRecordings(frame);
  showSettings(frame);
  showCalibration(frame.calibration);
  showWizard(frame);
  showPlayed(frame);
  showLearned(frame);
  find("controls").hidden = !frame.settings.length && !frame.calibration.length && !frame.learned;
}

function showNotes({ notes, alarms }) {
  if (!changed("notes", [notes, alarms])) return;
  const alarming = new Set(alarms.map(({ sentence }) => sentence));
  find("notes").hidden = !notes.length;
  find("notes").firstElementChild.replaceChildren(...notes.map((note) => (
    make("li", { className: alarming.has(note) ? "alarm" : "" }, note)
  )));
}

function showRecording({ recording, controls }) {
  find("recording").hidden = !recording;
  if (!recording) return;
  const { running, status, frames, dropped } = recording;
  find("record").disabled = find("tare").disabled = !controls;
  find("record").classList.toggle("on", running);
  find("record").setAttribute("aria-pressed", running);
  find("record").lastElementChild.textContent = running ? "Stop recording" : "Record";
  show("record-status", running ? `${frames} frames${dropped ? `, ${dropped} left out` : ""}` : "");
  find("record").title = `${status} (R)`;
}

function showFiles({ table, controls }) {
  for (const id of ["snapshot", "table"]) {
    find(id).hidden = table === null || table === undefined;
    find(id).disabled = !controls;
  }
  find("table").setAttribute("aria-pressed", Boolean(table));
  show("table", table ? "Stop CSV" : "CSV");
  find("table").title = table ? `Touches are written to ${table}` : "Write touches to a file *.csv, from now on";
}

function showRecordings({ recordings, controls }) {
  find("recordings").hidden = !recordings || !(controls || recordings.played);  // who may only look lists none
  if (!recordings || !changed("recordings", [recordings, controls])) return;
  const { names, played, address, trouble } = recordings;
  find("recordings-list").replaceChildren(...names.map((name) => {
    const button = make("button", { type: "button", disabled: !controls, title: `Open a page that plays ${name}` }, name);
    button.addEventListener("click", () => ask({ do: "playback", name }));
    return make("li", {}, button);
  }));
  find("playback").replaceChildren(...playback(played, address, trouble));
  if (!names.length && !played) show("playback", "None in the folder of the run");
}

function playback(played, address, trouble) {
  if (!played) return [];
  if (trouble) return [trouble];
  if (!address) return [`Opening ${played} …`];
  const page = new URL(address);
  page.hostname = location.hostname;  // as this page was reached
  return [make("a", { href: page.href, target: "_blank", rel: "noopener" }, `Watch ${played}`)];
}

function showSettings({ settings, controls }) {
  if (!changed("settings", [settings, controls])) return;
  find("settings").replaceChildren(...settings.map(({ key, label, value, choices }) => {
    const select = make("select", { disabled: !controls, name: key });
    select.append(...choices.map((choice) => make("option", { value: choice, selected: choice === value }, choice)));
    select.addEventListener("change", () => ask({ do: "set", key, value: select.value }));
    return make("label", {}, make("span", {}, label), select);
  }));
}

function showCalibration(parts) {
  if (!changed("calibration", parts)) return;
  find("calibration").replaceChildren(...parts.map(({ name, days, error, unit }) => make("tr", {},
    make("td", {}, name),
    make("td", { className: "muted" }, days ? `${days} day${days > 1 ? "s" : ""} old` : "today"),
    make("td", {}, `± ${inUnit(error, unit)}`))));
}

function showLearned({ learned, controls }) {
  find("learning").hidden = !learned;
  if (!learned || !changed("learned", [learned, controls])) return;
  const { sentence, weight } = learned;
  show("learned", sentence);
  find("lay").disabled = find("weight").disabled = !controls;
  show("lay", weight ? `Waits for ${weight} N` : "Lay it now");
}

function showWizard({ wizard, controls }) {
  document.body.classList.toggle("guided", wizard !== null);
  find("wizard").hidden = !wizard;
  if (!wizard || !changed("wizard", [wizard, controls])) return;
  const { sentence, taken, wanted, error, views } = wizard.progress;
  show("wizard-title", `Calibration: ${wizard.what}`);
  show("wizard-say", sentence);
  Object.assign(find("wizard-bar"), { max: wanted, value: taken });
  show("wizard-taken", `${taken} of ${wanted}`);
  show("wizard-error", error === null ? "" : ` · error ${inUnit(error, wizard.unit)}`);
  find("wizard-views").replaceChildren(...views.map(([view, text]) => {
    const button = make("button", { type: "button", disabled: !controls, title: "Drop this view" }, "×");
    button.setAttribute("aria-label", `Drop view ${view}`);
    button.addEventListener("click", () => ask({ do: "drop", view }));
    return make("li", {}, make("span", {}, `View ${view}`), make("small", {}, text), button);
  }));
}

function showPlayed({ played, controls }) {
  find("played").hidden = !played;
  if (!played) return;
  const { seconds, length, running } = played, seek = find("seek");
  find("play").disabled = seek.disabled = !controls;
  show("play", running ? "Pause" : "Play");
  seek.max = length;
  if (document.activeElement !== seek || running) seek.value = seconds;
  show("played-at", `${seconds.toFixed(1)} of ${length.toFixed(1)} s`);
}

find("play").addEventListener("click", () => ask({ do: "play" }));
find("seek").addEventListener("input", ({ target }) => ask({ do: "seek", to: Number(target.value) }));
find("record").addEventListener("click", () => ask({ do: "record" }));
find("recordings").querySelector("details").addEventListener("toggle", ({ target }) => {
  if (target.open) ask({ do: "recordings" });
});
find("snapshot").addEventListener("click", () => ask({ do: "snapshot" }));
find("table").addEventListener("click", () => ask({ do: "csv" }));
find("tare").addEventListener("click", () => ask({ do: "tare" }));
find("weigh").addEventListener("submit", (event) => {
  event.preventDefault();
  ask({ do: "weigh", force: Number(find("weight").value) });
});
