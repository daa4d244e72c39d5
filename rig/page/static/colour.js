// Diverging colours for signed strain: blue below zero, red above, lightness falling evenly with
// the magnitude in OKLab (Ottosson 2020), so that equal steps of strain look equal.

const MIDDLE = 0.94, END = 0.42;               // OKLab lightness at zero and at the limits
const NEGATIVE = { hue: 258, chroma: 0.17 };   // degrees, OKLab
const POSITIVE = { hue: 32, chroma: 0.18 };

const LEVELS = 256;
const PALETTE = new Uint32Array(Uint8ClampedArray.from({ length: 4 * LEVELS }, (_, i) =>
  [...diverging(2 * Math.floor(i / 4) / (LEVELS - 1) - 1), 255][i % 4]).buffer);

function diverging(t) {
  const side = t < 0 ? NEGATIVE : POSITIVE, far = Math.abs(t);
  const chroma = side.chroma * far * (1.7 - 0.7 * far);
  const angle = side.hue * Math.PI / 180;
  return srgb(MIDDLE + (END - MIDDLE) * far, chroma * Math.cos(angle), chroma * Math.sin(angle));
}

function srgb(L, a, b) {
  const l = (L + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (L - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (L - 0.0894841775 * a - 1.2914855480 * b) ** 3;
  return [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s,
  ].map((linear) => {
    const x = Math.min(Math.max(linear, 0), 1);
    return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  });
}

// One pixel a strain value; no value (NaN) is clear.
export function paintStrain(values, [rows, columns], limit) {
  const image = new ImageData(columns, rows), pixels = new Uint32Array(image.data.buffer);
  const scale = (LEVELS - 1) / (2 * limit);
  for (let i = 0; i < values.length; i++) {
    if (Number.isNaN(values[i])) continue;
    pixels[i] = PALETTE[Math.round(Math.min(Math.max((values[i] + limit) * scale, 0), LEVELS - 1))];
  }
  return image;
}

export function paintRamp(canvas) {
  const image = new ImageData(new Uint8ClampedArray(PALETTE.buffer), LEVELS, 1);
  canvas.getContext("2d").putImageData(image, 0, 0);
}

const STEPS = [1, 1.5, 2, 3, 4, 5, 6, 8, 10];

// A round number not below x.
export function roundUp(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  return power * STEPS.find((step) => step * power >= x * (1 - 1e-9));
}

const SAMPLE = 2000;  // values looked at for the limit: the 99th percentile needs no more

// A symmetric limit that grows at once and shrinks only after the strain stayed small for 2 s.
export class Limit {
  constructor() { this.value = 1e-5; this.small = null; }

  follow(values, sigma, now) {
    const stride = Math.ceil(values.length / SAMPLE);
    const sizes = values.filter((x, i) => i % stride === 0 && !Number.isNaN(x)).map(Math.abs).sort();
    if (!sizes.length) return this.value;
    const wanted = roundUp(Math.max(sizes[Math.floor(0.99 * (sizes.length - 1))], 3 * sigma, 1e-6));
    if (wanted >= this.value) this.small = null;
    else this.small ??= now;
    if (wanted > this.value || (this.small !== null && now - this.small > 2)) this.value = wanted;
    return this.value;
  }
}
