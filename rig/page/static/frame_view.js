// What is drawn of a frame: camera or projector view, strain map, plate outline and touches over it.
// Image coordinates have their origin at the centre of the top-left pixel.

import { paintStrain } from "./colour.js";

const PATTERN = "#1fe3bb", STRAIN = "#ffc54d", TRUTH = "#ffffff", HALO = "#000000a6";
const COMPONENTS = ["exx", "eyy", "exy"];

export function through(T, x, y) {
  const w = T[2][0] * x + T[2][1] * y + T[2][2];
  return [(T[0][0] * x + T[0][1] * y + T[0][2]) / w, (T[1][0] * x + T[1][1] * y + T[1][2]) / w];
}

export function inverse([[a, b, c], [d, e, f], [g, h, i]]) {  // up to scale, as a homography needs
  return [[e * i - f * h, c * h - b * i, b * f - c * e],
    [f * g - d * i, a * i - c * g, c * d - a * f],
    [d * h - e * g, b * g - a * h, a * e - b * d]];
}

export function component(frame, name) {
  const number = COMPONENTS.indexOf(name);
  if (!frame.values || number < 0) return null;
  const [rows, columns] = frame.strain.shape, start = number * rows * columns;
  return frame.values.subarray(start, start + rows * columns);
}

export function strainAt(frame, x, y) {
  if (!frame.values) return null;
  const [rows, columns] = frame.strain.shape, { x: [x0, x1], y: [y0, y1] } = frame.strain;
  const column = Math.round((x - x0) / (x1 - x0) * (columns - 1));
  const row = Math.round((y - y0) / (y1 - y0) * (rows - 1));
  if (!(column >= 0 && column < columns && row >= 0 && row < rows)) return null;
  return COMPONENTS.map((name) => component(frame, name)[row * columns + column]);
}

// Corners run (0, 0), (a, 0), (a, b), (0, b): with the clock where the plate is turned over, y down.
function seenFromBelow(outline) {
  const area = outline.reduce((sum, [x, y], i) => {
    const [nextX, nextY] = outline[(i + 1) % outline.length];
    return sum + x * nextY - nextX * y;
  }, 0);
  return area > 0;
}

export class FrameView {
  constructor(canvas, box) {
    this.canvas = canvas;
    this.box = box;
    this.context = canvas.getContext("2d");
    this.map = new OffscreenCanvas(1, 1);
  }

  // choice: { view, component, opacity, limit, pin }
  draw(frame, choice) {
    if (choice.view === "projector" && frame.projectorBitmap) this.drawProjector(frame);
    if (choice.view === "camera" && frame.cameraBitmap) this.drawCamera(frame, choice);
  }

  fit([width, height]) {
    const wide = this.box.clientWidth;
    const high = getComputedStyle(this.box).flexGrow === "0" ? Infinity : this.box.clientHeight;
    const scale = Math.min(wide / width, high / height), dots = window.devicePixelRatio || 1;
    const [w, h] = [Math.round(width * scale * dots), Math.round(height * scale * dots)];
    if (this.canvas.width !== w || this.canvas.height !== h) {
      this.canvas.width = w;
      this.canvas.height = h;
      this.canvas.style.width = `${w / dots}px`;
      this.canvas.style.height = `${h / dots}px`;
    }
    this.scale = w / width;
    this.dots = dots;
  }

  at([x, y]) { return [(x + 0.5) * this.scale, (y + 0.5) * this.scale]; }

  toImage(event) {
    return [event.offsetX * this.dots / this.scale - 0.5, event.offsetY * this.dots / this.scale - 0.5];
  }

  drawProjector(frame) {
    const { context, canvas } = this;
    this.fit(frame.projector.size);
    context.drawImage(frame.projectorBitmap, 0, 0, canvas.width, canvas.height);
    this.trace(frame.projector.outline.map((corner) => this.at(corner)));
    context.setLineDash([4 * this.dots, 4 * this.dots]);
    this.stroke("#ffffff66", 1);
    context.setLineDash([]);
    context.fillStyle = "#ffffff99";
    context.font = `${12 * this.dots}px system-ui, sans-serif`;
    context.textAlign = "left";
    context.fillText("brightened for the page; the plate's edge is not projected", 12 * this.dots, canvas.height - 12 * this.dots);
  }

  drawCamera(frame, choice) {
    const { context, canvas } = this;
    this.fit(frame.size);
    context.drawImage(frame.cameraBitmap, 0, 0, canvas.width, canvas.height);
    if (choice.component !== "none") this.drawStrain(frame, choice);
    this.trace(frame.outline.map((corner) => this.at(corner)));
    this.outline("#ffffffd0", 1.5);
    this.drawAxes(frame);
    if (seenFromBelow(frame.outline)) this.drawSide();
    for (const mark of frame.truth ?? []) this.drawTruth(frame, mark);
    for (const mark of frame.from_strain ?? []) this.drawStrainMark(frame, mark);
    for (const mark of frame.touches) this.drawTouch(frame, mark);
    const last = new Map(frame.gestures?.map((gesture) => [gesture.identities.join(), gesture]));  // of each finger
    for (const gesture of last.values()) this.drawGesture(frame, gesture);
    if (choice.pin) this.drawPin(frame, choice.pin);
  }

  drawAxes(frame) {
    const { context, dots } = this, length = Math.min(...frame.plate) / 12;
    for (const [name, x, y] of [["x", length, 0], ["y", 0, length]]) {
      context.beginPath();
      context.moveTo(...this.at(through(frame.T_px_plate, 0, 0)));
      context.lineTo(...this.at(through(frame.T_px_plate, x, y)));
      this.outline("#ffffff", 3);
      context.textAlign = "center";
      context.textBaseline = "middle";
      this.write(name, this.at(through(frame.T_px_plate, 1.35 * x, 1.35 * y)), 13);
    }
    context.textBaseline = "alphabetic";
  }

  drawSide() {
    const { context, canvas, dots } = this;
    context.textAlign = "left";
    this.write("underside, seen from below", [12 * dots, canvas.height - 12 * dots], 13);
  }

  drawStrain(frame, { component: name, opacity, limit }) {
    const values = component(frame, name);
    if (!values) return;
    const [rows, columns] = frame.strain.shape, { x: [x0, x1], y: [y0, y1] } = frame.strain;
    Object.assign(this.map, { width: columns, height: rows });
    this.map.getContext("2d").putImageData(paintStrain(values, frame.strain.shape, limit), 0, 0);
    const dx = (x1 - x0) / Math.max(columns - 1, 1), dy = (y1 - y0) / Math.max(rows - 1, 1);
    const [left, top] = this.at([x0 - dx / 2, y0 - dy / 2]);
    this.context.globalAlpha = opacity;
    this.context.drawImage(this.map, left, top, columns * dx * this.scale, rows * dy * this.scale);
    this.context.globalAlpha = 1;
  }

  drawTruth(frame, mark) {
    const [x, y] = this.at(through(frame.T_px_plate, mark.x, mark.y));
    this.context.beginPath();
    this.context.arc(x, y, 13 * this.dots, 0, 2 * Math.PI);
    this.outline(TRUTH, 2);
  }

  drawStrainMark(frame, mark) {
    const [x, y] = this.at(through(frame.T_px_plate, mark.x, mark.y)), r = 9 * this.dots;
    this.trace([[x, y - r], [x + r, y], [x, y + r], [x - r, y]]);
    this.outline(STRAIN, 2);
  }

  // Its kind, where it happened, as long as the frames name it: a second.
  drawGesture(frame, { kind, x, y }) {
    const [column, row] = this.at(through(frame.T_px_plate, x, y));
    this.context.textAlign = "center";
    this.write(kind, [column, row + 32 * this.dots], 14);
  }

  drawPin(frame, [x, y]) {
    const [column, row] = this.at(through(frame.T_px_plate, x, y)), reach = 9 * this.dots;
    this.context.beginPath();
    for (const [dx, dy] of [[reach, 0], [0, reach]]) {
      this.context.moveTo(column - dx, row - dy);
      this.context.lineTo(column + dx, row + dy);
    }
    this.outline("#ffffff", 1.5);
  }

  drawTouch(frame, mark) {
    const { context, dots } = this;
    const [x, y] = this.at(through(frame.T_px_plate, mark.x, mark.y));
    context.beginPath();
    context.arc(x, y, (2.5 + 2 * Math.sqrt(Math.max(mark.force, 0))) * dots, 0, 2 * Math.PI);
    context.fillStyle = PATTERN;
    context.fill();
    this.stroke(HALO, 1);
    this.trace(this.ellipse(frame, mark, [x, y]));
    this.outline(PATTERN, 1.5);
    const text = `${mark.force.toFixed(2)} N`;
    const side = x + 90 * dots > this.canvas.width ? -1 : 1;
    context.textAlign = side > 0 ? "left" : "right";
    this.write(text, [x + side * 18 * dots, y - 12 * dots], 14);
  }

  // Two sigma, seen through the homography; grown evenly where it would be too small to see.
  ellipse(frame, mark, [x, y]) {
    const [a, b, angle] = mark.sigma.map((part) => part ?? 0);
    const points = Array.from({ length: 48 }, (_, i) => {
      const turn = i * Math.PI / 24, u = 2 * a * Math.cos(turn), v = 2 * b * Math.sin(turn);
      const px = mark.x + u * Math.cos(angle) - v * Math.sin(angle);
      const py = mark.y + u * Math.sin(angle) + v * Math.cos(angle);
      return this.at(through(frame.T_px_plate, px, py));
    });
    const reach = Math.max(...points.map(([px, py]) => Math.hypot(px - x, py - y)));
    const smallest = 8 * this.dots;
    if (reach < 0.01) return points.map((_, i) => [x + smallest * Math.cos(i * Math.PI / 24), y + smallest * Math.sin(i * Math.PI / 24)]);
    const grow = Math.max(1, smallest / reach);
    return points.map(([px, py]) => [x + grow * (px - x), y + grow * (py - y)]);
  }

  write(words, place, size) {
    const { context, dots } = this;
    context.font = `600 ${size * dots}px system-ui, sans-serif`;
    Object.assign(context, { lineJoin: "round", strokeStyle: "#000000c0", lineWidth: 4 * dots });
    context.strokeText(words, ...place);
    context.fillStyle = "#ffffff";
    context.fillText(words, ...place);
  }

  trace(points) {
    this.context.beginPath();
    for (const point of points) this.context.lineTo(...point);
    this.context.closePath();
  }

  outline(colour, width) {  // a dark halo keeps the line legible on any speckle or strain
    this.stroke(HALO, width + 2.5);
    this.stroke(colour, width);
  }

  stroke(colour, width) {
    Object.assign(this.context, { strokeStyle: colour, lineWidth: width * this.dots });
    this.context.stroke();
  }
}
