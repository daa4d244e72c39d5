// Draws an image, a field over it, and marks; knows which place of the image a pointer shows.

import { corners } from "./grid.js";

const HALO = "#000000a0", NEAR = 10;  // css px at which an end is taken hold of

export class Drawing {
  constructor(canvas, box) {
    Object.assign(this, { canvas, box, context: canvas.getContext("2d"), map: new OffscreenCanvas(1, 1) });
    Object.assign(this, { size: [1, 1], zoom: 1, middle: [0.5, 0.5] });
  }

  // Take the size of the box; the image is fitted into it, `zoom` times larger about `middle`.
  begin(size) {
    if (size[0] !== this.size[0] || size[1] !== this.size[1]) this.fit(size);
    const dots = window.devicePixelRatio || 1;
    this.box.style.setProperty("--ratio", size[0] / size[1]);  // where the box has no height of its own
    const [w, h] = [Math.round(this.box.clientWidth * dots), Math.round(this.box.clientHeight * dots)];
    if (this.canvas.width !== w || this.canvas.height !== h) {
      Object.assign(this.canvas, { width: w, height: h });
      Object.assign(this.canvas.style, { width: `${w / dots}px`, height: `${h / dots}px` });
    }
    this.dots = dots;
    this.scale = this.zoom * Math.min(w / size[0], h / size[1]);
    this.origin = [w / 2 - this.middle[0] * size[0] * this.scale, h / 2 - this.middle[1] * size[1] * this.scale];
    this.context.clearRect(0, 0, w, h);
  }

  fit(size = this.size) { Object.assign(this, { size, zoom: 1, middle: [0.5, 0.5] }); }

  at([x, y]) { return [(x + 0.5) * this.scale + this.origin[0], (y + 0.5) * this.scale + this.origin[1]]; }

  toImage(event) {
    return [event.offsetX, event.offsetY].map((place, i) => (place * this.dots - this.origin[i]) / this.scale - 0.5);
  }

  isNear(event, place) {
    const [x, y] = this.at(place);
    return Math.hypot(event.offsetX * this.dots - x, event.offsetY * this.dots - y) < NEAR * this.dots;
  }

  // Zoom so that what is under a place of the image stays there.
  zoomAbout([x, y], factor) {
    const zoom = Math.min(Math.max(this.zoom * factor, 1), 200), kept = this.zoom / zoom;
    const [u, v] = [(x + 0.5) / this.size[0], (y + 0.5) / this.size[1]];
    this.middle = [u + (this.middle[0] - u) * kept, v + (this.middle[1] - v) * kept];
    this.zoom = zoom;
    this.keepInside();
  }

  pan(dx, dy) {
    this.middle = [this.middle[0] - dx * this.dots / this.scale / this.size[0], this.middle[1] - dy * this.dots / this.scale / this.size[1]];
    this.keepInside();
  }

  keepInside() {
    const half = 0.5 / this.zoom;
    this.middle = this.middle.map((at) => (this.zoom === 1 ? 0.5 : Math.min(Math.max(at, half), 1 - half)));
  }

  image(bitmap) {
    this.context.imageSmoothingEnabled = this.scale < 3;
    this.context.drawImage(bitmap, ...this.origin, this.size[0] * this.scale, this.size[1] * this.scale);
  }

  // Cells of a grid in their colours; moved by what the points have moved, if that is given.
  field(grid, colours, opacity, motion = null) {
    const sheet = this.sheet(grid, colours, motion);
    const [left, top] = motion ? [0, 0] : this.at([grid.x[0] - grid.step / 2, grid.y[0] - grid.step / 2]);
    const side = motion ? 1 : grid.step * this.scale;
    Object.assign(this.context, { globalAlpha: opacity, imageSmoothingEnabled: false });
    this.context.drawImage(sheet, left, top, sheet.width * side, sheet.height * side);
    this.context.globalAlpha = 1;
  }

  // The cells are painted anew only where they or the view have changed: not as the pointer moves.
  sheet(grid, colours, motion) {
    const key = [grid, colours, motion, ...(motion ? [this.scale, ...this.origin, this.canvas.width, this.canvas.height] : [])];
    if (this.painted?.length !== key.length || key.some((part, i) => part !== this.painted[i])) {
      this.painted = key;
      if (motion) this.movedCells(grid, colours, motion);
      else this.cells(grid, colours);
    }
    return this.map;
  }

  cells(grid, colours) {
    Object.assign(this.map, { width: grid.columns, height: grid.rows });
    const image = new ImageData(new Uint8ClampedArray(colours.buffer), grid.columns, grid.rows);
    this.map.getContext("2d").putImageData(image, 0, 0);
  }

  // Each cell between its moved corners, with a rim of its colour so that no seam shows.
  movedCells(grid, colours, motion) {
    const { scale, map } = this, [du, dv] = corners(grid, motion), wide = grid.columns + 1;
    Object.assign(map, { width: this.canvas.width, height: this.canvas.height });
    const pen = map.getContext("2d"), bytes = new Uint8Array(colours.buffer), side = grid.step * scale;
    for (let n = 0; n < colours.length; n++) {
      if (!colours[n] || Number.isNaN(motion.u[n])) continue;
      const row = Math.floor(n / grid.columns), column = n % grid.columns, first = row * wide + column;
      const [x, y] = this.at([grid.x[column] - grid.step / 2, grid.y[row] - grid.step / 2]);
      pen.fillStyle = pen.strokeStyle = `rgb(${bytes[4 * n]} ${bytes[4 * n + 1]} ${bytes[4 * n + 2]})`;
      pen.beginPath();
      for (const [at, right, down] of [[first, 0, 0], [first + 1, side, 0], [first + wide + 1, side, side], [first + wide, 0, side]]) {
        pen.lineTo(x + right + du[at] * scale, y + down + dv[at] * scale);
      }
      pen.closePath();
      pen.fill();
      pen.stroke();
    }
  }

  points(grid, numbers) {
    this.context.fillStyle = "#ffffffb0";
    const side = 1.6 * this.dots;
    for (const number of numbers) {
      const [x, y] = this.at(grid.place(number));
      this.context.fillRect(x - side / 2, y - side / 2, side, side);
    }
  }

  square([x, y], side, colour) {
    const half = side / 2;
    this.path([[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]], colour, 1.5, true);
  }

  path(places, colour, width, closed = false, dash = []) {
    const { context } = this;
    context.beginPath();
    for (const place of places) context.lineTo(...this.at(place));
    if (closed) context.closePath();
    this.stroke(HALO, width + 2.5);
    context.setLineDash(dash.map((length) => length * this.dots));
    this.stroke(colour, width);
    context.setLineDash([]);
  }

  // Darken what lies outside of the polygons, and what lies in their holes.
  shade(polygons) {
    if (!polygons.length) return;
    const mask = new OffscreenCanvas(this.canvas.width, this.canvas.height), pen = mask.getContext("2d");
    const fill = (points, how) => {
      pen.globalCompositeOperation = how;
      pen.beginPath();
      for (const place of points) pen.lineTo(...this.at(place));
      pen.fill();
    };
    const kept = polygons.filter(({ hole }) => !hole);
    if (kept.length) pen.fillRect(...this.at([-0.5, -0.5]), this.size[0] * this.scale, this.size[1] * this.scale);
    for (const { points } of kept) fill(points, "destination-out");
    for (const { points, hole } of polygons) if (hole) fill(points, "source-over");
    this.context.globalAlpha = 0.55;
    this.context.drawImage(mask, 0, 0);
    this.context.globalAlpha = 1;
  }

  handle(place, colour, chosen = false) {
    const { context, dots } = this;
    context.beginPath();
    context.arc(...this.at(place), (chosen ? 6 : 4.5) * dots, 0, 2 * Math.PI);
    context.fillStyle = colour;
    this.stroke(HALO, 4);
    context.fill();
    this.stroke("#ffffff", 1.5);
  }

  cross(place, colour, chosen) {
    const [x, y] = this.at(place), reach = (chosen ? 11 : 9) * this.dots, { context } = this;
    context.beginPath();
    for (const [dx, dy] of [[1, 0], [0, 1]]) {
      context.moveTo(x - dx * reach, y - dy * reach);
      context.lineTo(x + dx * reach, y + dy * reach);
    }
    this.stroke(HALO, 5);
    this.stroke(colour, 2.5);
  }

  // The ends of an extensometer stand across its line, as knife edges do.
  edges([start, end], colour, chosen) {
    const [a, b] = [this.at(start), this.at(end)], length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
    const reach = (chosen ? 11 : 9) * this.dots, [dx, dy] = [-(b[1] - a[1]) / length * reach, (b[0] - a[0]) / length * reach];
    const { context } = this;
    context.beginPath();
    for (const [x, y] of [a, b]) {
      context.moveTo(x - dx, y - dy);
      context.lineTo(x + dx, y + dy);
    }
    this.stroke(HALO, 5.5);
    this.stroke(colour, 3);
  }

  write(words, place, offset = [0, 0], align = "left") {
    const { context, dots } = this, [x, y] = this.at(place);
    context.font = `600 ${13 * dots}px system-ui, sans-serif`;
    Object.assign(context, { lineJoin: "round", strokeStyle: "#000000c0", lineWidth: 4 * dots, textAlign: align, textBaseline: "middle" });
    const at = [x + offset[0] * dots, y + offset[1] * dots];
    context.strokeText(words, ...at);
    context.fillStyle = "#ffffff";
    context.fillText(words, ...at);
  }

  stroke(colour, width) {
    Object.assign(this.context, { strokeStyle: colour, lineWidth: width * this.dots });
    this.context.stroke();
  }
}
