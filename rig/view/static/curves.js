// Curves with a band of ± σ. What was lost is a gap, never a line that nobody measured.

const STEPS = [1, 2, 5, 10];
const LEFT = 58, RIGHT = 12, TOP = 10, BELOW = 34;  // css px about the axes

export function ticks(low, high, room) {
  const smallest = (high - low) / Math.max(room, 1), power = 10 ** Math.floor(Math.log10(smallest));
  const step = STEPS.find((one) => one * power >= smallest * (1 - 1e-9)) * power;
  const places = Math.min(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), 12);
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n++) found.push([n * step, (n * step).toFixed(places)]);
  return found;
}

const known = (values) => values.filter(Number.isFinite);

export class Curves {
  // pick(x): called with the place along the axis that was clicked
  constructor(canvas, pick) {
    Object.assign(this, { canvas, shown: null, pointer: null });
    canvas.addEventListener("pointermove", (event) => { this.pointer = event.offsetX; this.draw(); });
    canvas.addEventListener("pointerleave", () => { this.pointer = null; this.draw(); });
    canvas.addEventListener("click", (event) => { if (this.shown) pick?.(this.valueAt(event.offsetX)); });
  }

  // shown: { series: [{ name, colour, x, y, s }], axis, unit, at }
  show(shown) {
    this.shown = shown;
    this.draw();
  }

  draw() {
    const { canvas, shown } = this, dots = window.devicePixelRatio || 1;
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    if (!shown || !wide) return;
    Object.assign(canvas, { width: wide * dots, height: high * dots });
    const pen = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
    pen.scale(dots, dots);
    const ink = (name) => style.getPropertyValue(`--${name}`);
    this.limits(shown.series);
    this.x = (value) => LEFT + (value - this.left) / (this.right - this.left) * (wide - LEFT - RIGHT);
    this.y = (value) => high - BELOW - (value - this.low) / (this.high - this.low) * (high - TOP - BELOW);
    this.axes(pen, ink, wide, high);
    pen.save();
    pen.beginPath();
    pen.rect(LEFT, TOP - 4, wide - LEFT - RIGHT + 4, high - TOP - BELOW + 8);
    pen.clip();
    for (const one of shown.series) this.curve(pen, one);
    pen.restore();
    if (this.pointer !== null) this.readout(pen, ink, wide);
  }

  limits(series) {
    const x = known(series.flatMap((one) => one.x));
    const y = known(series.flatMap(({ y, s }) => y.flatMap((value, i) => [value - (s[i] || 0), value + (s[i] || 0)])));
    [this.left, this.right] = x.length ? [Math.min(...x), Math.max(...x)] : [0, 1];
    [this.low, this.high] = y.length ? [Math.min(...y), Math.max(...y)] : [0, 1];
    if (this.right - this.left < 1e-12) [this.left, this.right] = [this.left - 0.5, this.right + 0.5];
    const room = Math.max((this.high - this.low) * 0.06, 1e-9 * Math.max(Math.abs(this.high), 1e-3));
    [this.low, this.high] = [this.low - room, this.high + room];
  }

  axes(pen, ink, wide, high) {
    Object.assign(pen, { font: "11px system-ui, sans-serif", strokeStyle: ink("line"), fillStyle: ink("muted"), lineWidth: 1 });
    Object.assign(pen, { textBaseline: "middle", textAlign: "right" });
    for (const [value, text] of ticks(this.low, this.high, (high - TOP - BELOW) / 32)) {
      const y = Math.round(this.y(value)) + 0.5;
      pen.beginPath();
      pen.moveTo(LEFT, y);
      pen.lineTo(wide - RIGHT, y);
      pen.stroke();
      pen.fillText(text.replace("-", "−"), LEFT - 7, y);
    }
    Object.assign(pen, { textBaseline: "alphabetic", textAlign: "center" });
    for (const [value, text] of ticks(this.left, this.right, (wide - LEFT - RIGHT) / 60)) pen.fillText(text.replace("-", "−"), this.x(value), high - BELOW + 15);
    pen.fillText(this.shown.axis, (LEFT + wide - RIGHT) / 2, high - 4);
    pen.save();
    pen.translate(11, (TOP + high - BELOW) / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(this.shown.unit, 0, 0);
    pen.restore();
    if (this.shown.at !== undefined) {
      pen.strokeStyle = ink("muted");
      pen.setLineDash([3, 3]);
      pen.beginPath();
      pen.moveTo(this.x(this.shown.at), TOP);
      pen.lineTo(this.x(this.shown.at), high - BELOW);
      pen.stroke();
      pen.setLineDash([]);
    }
  }

  curve(pen, { colour, x, y, s }) {
    Object.assign(pen, { strokeStyle: colour, fillStyle: colour, lineWidth: 1.75, lineJoin: "round" });
    for (const run of runs(y)) {
      pen.globalAlpha = 0.22;
      pen.beginPath();
      for (const i of run) pen.lineTo(this.x(x[i]), this.y(y[i] + (s[i] || 0)));
      for (const i of [...run].reverse()) pen.lineTo(this.x(x[i]), this.y(y[i] - (s[i] || 0)));
      pen.fill();
      pen.globalAlpha = 1;
      pen.beginPath();
      for (const i of run) pen.lineTo(this.x(x[i]), this.y(y[i]));
      pen.stroke();
    }
    if (known(y).length > 60) return;
    y.forEach((value, i) => {
      if (!Number.isFinite(value)) return;
      pen.beginPath();
      pen.arc(this.x(x[i]), this.y(value), 2.2, 0, 2 * Math.PI);
      pen.fill();
    });
  }

  valueAt(offset) {
    const wide = this.canvas.clientWidth;
    return this.left + (offset - LEFT) / (wide - LEFT - RIGHT) * (this.right - this.left);
  }

  // The values nearest to the pointer, in a corner.
  readout(pen, ink, wide) {
    const at = this.valueAt(this.pointer);
    Object.assign(pen, { font: "600 11px system-ui, sans-serif", textAlign: "right", textBaseline: "top", lineWidth: 3, strokeStyle: ink("card") });
    this.shown.series.forEach(({ name, colour, x, y, s }, row) => {
      const i = x.reduce((best, value, n) => (Math.abs(value - at) < Math.abs(x[best] - at) ? n : best), 0);
      const text = `${name}  ${short(x[i])}: ${withSigma(y[i], s[i])}`;
      pen.strokeText(text, wide - RIGHT, TOP + 14 * row);
      pen.fillStyle = colour;
      pen.fillText(text, wide - RIGHT, TOP + 14 * row);
    });
  }
}

export function short(value) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  return (size >= 1000 ? value.toFixed(0) : String(+value.toPrecision(size >= 100 ? 4 : 3))).replace("-", "−");
}

// A value and its σ, both to the second digit of σ.
export function withSigma(value, sigma) {
  if (!Number.isFinite(sigma) || !Number.isFinite(value) || sigma <= 0) return `${short(value)} ± ${short(sigma)}`;
  const places = Math.min(Math.max(0, 1 - Math.floor(Math.log10(sigma))), 9);
  return `${value.toFixed(places).replace("-", "−")} ± ${sigma.toFixed(places)}`;
}

function runs(values) {
  const found = [];
  let run = null;
  values.forEach((value, i) => {
    if (!Number.isFinite(value)) run = null;
    else if (run) run.push(i);
    else found.push(run = [i]);
  });
  return found;
}
