// Export of what is seen: files that the server writes, and the image as it stands on the screen.

import { Colours } from "./colours.js";
import { short } from "./curves.js";
import { askedFor, readings } from "./marks.js";
import { keep, save } from "./server.js";
import { drawnNow, find, frames, state } from "./state.js";

const marked = (kind) => {
  const marks = state.marks.filter((mark) => mark.kind === kind);
  return marks.includes(state.chosen) ? state.chosen : marks[0];
};

const asked = (what) => ({ asked: JSON.stringify(what) });

function wanted(file) {
  const { frame } = state, [low, high] = state.limits.get(drawnNow().name) ?? [];
  const [name, kind] = file.split(".");
  switch (name) {
    case "field": return ["files/field.png", { name: drawnNow().name, frame, ...(low < high ? { low, high } : {}) }];
    case "frame": return ["files/frame.csv", { frame }];
    case "readings": return [`files/readings.${kind}`, asked(readings())];
    case "point": return [`files/line.${kind}`, asked(askedFor(marked("point"), null))];
    case "line": return [`files/line.${kind}`, asked(askedFor(marked("line"), null))];
    default: return ["files/test.zip", { way: find("way").value, field: state.field }];
  }
}

export async function exportFile(file, drawing) {
  if (file === "screen.png") keep(await screen(drawing), `${drawnNow().name}-${String(state.frame).padStart(6, "0")}-seen.png`);
  else await save(...wanted(file));
}

// What is seen of the image, and below it what the colours mean.
function screen({ canvas, origin, size, scale, dots }) {
  const below = 64 * dots, drawn = drawnNow(), narrowest = 420 * dots;
  const [left, top] = origin.map((at) => Math.max(Math.floor(at), 0));
  const [right, bottom] = [canvas.width, canvas.height].map((end, i) => Math.min(Math.ceil(origin[i] + size[i] * scale), end));
  const [wide, high] = [right - left, bottom - top];
  const sheet = new OffscreenCanvas(Math.max(wide, narrowest), high + below), pen = sheet.getContext("2d");
  pen.fillStyle = "#ffffff";
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.drawImage(canvas, left, top, wide, high, 0, 0, wide, high);
  Object.assign(pen, { fillStyle: "#14181b", font: `${13 * dots}px system-ui, sans-serif`, textBaseline: "middle" });
  const y = high + 22 * dots, long = Math.min(260 * dots, sheet.width / 3);
  pen.fillText(`${drawn.title}${drawn.unit && `, ${drawn.unit}`} · ${frames()[state.frame].name}`, 14 * dots, high + 46 * dots);
  const limits = state.limits.get(drawn.name);
  if (limits && drawn.name !== "status") {
    const ramp = document.createElement("canvas");
    ramp.height = 1;
    new Colours(drawn).paintRamp(ramp);
    const low = short(limits[0]), from = 22 * dots + pen.measureText(low).width;
    pen.fillText(low, 14 * dots, y);
    pen.drawImage(ramp, from, y - 7 * dots, long, 14 * dots);
    pen.fillText(`${short(limits[1])} ${drawn.unit}`, from + long + 8 * dots, y);
  }
  return sheet.convertToBlob({ type: "image/png" });
}
