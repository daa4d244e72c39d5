// Colours of a field: those of the plots that are exported, given by the server.

const CLEAR = 0;

function packed(hex) {
  const [r, g, b] = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
  return new Uint32Array(new Uint8ClampedArray([r, g, b, 255]).buffer)[0];
}

export class Colours {
  constructor({ name, factor, colours }) {
    Object.assign(this, { factor, names: colours, status: name === "status" });
    this.packed = Uint32Array.from(colours, packed);
  }

  // One number a value; clear where there is none. Limits are in the unit of the field.
  of(values, [low, high]) {
    const { packed, factor } = this, last = packed.length - 1;
    const scale = packed.length / (high - low), found = new Uint32Array(values.length);
    for (let i = 0; i < values.length; i++) {
      const value = values[i] * factor;
      if (Number.isNaN(value) || (this.status && value < 0)) found[i] = CLEAR;
      else found[i] = packed[Math.min(Math.max(Math.floor((value - low) * scale), 0), last)];
    }
    return found;
  }

  paintRamp(canvas) {
    canvas.width = this.packed.length;
    const image = new ImageData(new Uint8ClampedArray(this.packed.slice().buffer), this.packed.length, 1);
    canvas.getContext("2d").putImageData(image, 0, 0);
  }
}

export const MARKS = ["#14a38b", "#e8590c", "#4263eb", "#c2255c", "#f2b705", "#7048e8", "#2f9e44", "#0b7285"];
