// Colours of the order of work. The stops come from --seq-stops in tokens.css; between them we mix in OKLab (Ottosson 2020)
// with equal steps along the whole line, so that any number of regions gets evenly spread colours that only become lighter.

const TO_LMS = [[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566], [0.0883024619, 0.2817188376, 0.6299787005]];
const LMS_TO_LAB = [[0.2104542553, 0.793617785, -0.0040720468], [1.9779984951, -2.428592205, 0.4505937099], [0.0259040371, 0.7827717662, -0.808675766]];
const LAB_TO_LMS = [[1, 0.3963377774, 0.2158037573], [1, -0.1055613458, -0.0638541728], [1, -0.0894841775, -1.291485548]];
const LMS_TO_RGB = [[4.0767416621, -3.3077115913, 0.2309699292], [-1.2684380046, 2.6097574011, -0.3413193965], [-0.0041960863, -0.7034186147, 1.707614701]];

const times = (matrix, vector) => matrix.map((row) => row.reduce((sum, entry, index) => sum + entry * vector[index], 0));
const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
const gamma = (c) => (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);
const channels = (hex) => [1, 3, 5].map((at) => linear(parseInt(hex.slice(at, at + 2), 16) / 255));
const toLab = (hex) => times(LMS_TO_LAB, times(TO_LMS, channels(hex)).map(Math.cbrt));
const between = (a, b, t) => a.map((value, index) => value + (b[index] - value) * t);

function toHex(lab) {
  const rgb = times(LMS_TO_RGB, times(LAB_TO_LMS, lab).map((v) => v ** 3));
  return `#${rgb.map((c) => Math.round(255 * gamma(Math.min(1, Math.max(0, c)))).toString(16).padStart(2, "0")).join("")}`;
}

const words = (property) => getComputedStyle(document.documentElement).getPropertyValue(property).trim().split(/\s+/);

let known = { source: "", stops: [], lengths: [], total: 0 };

function line() {
  const hexes = words("--seq-stops");
  const source = hexes.join();
  if (source !== known.source) {
    const stops = hexes.map(toLab);
    const lengths = stops.slice(1).map((stop, index) => Math.hypot(...stop.map((value, axis) => value - stops[index][axis])));
    known = { source, stops, lengths, total: lengths.reduce((sum, length) => sum + length, 0) };
  }
  return known;
}

// Colour of place i (from 0) of n as a hex string.
export function rampColour(i, n) {
  const { stops, lengths, total } = line();
  let rest = (n > 1 ? i / (n - 1) : 0) * total;
  let part = 0;
  while (part < lengths.length - 1 && rest > lengths[part]) rest -= lengths[part++];
  return toHex(between(stops[part], stops[part + 1], Math.min(1, rest / lengths[part])));
}

// Black or white, whichever reads better on the colour (0.179 is where the two contrasts are equal).
export function inkOn(hex) {
  const [r, g, b] = channels(hex);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.179 ? "#000000" : "#ffffff";
}

export const mix = (a, b, t) => toHex(between(toLab(a), toLab(b), t));

// Quiet colour of a region nobody has done yet, by its id.
export function tint(region) {
  const tints = words("--region-tints");
  return tints[region % tints.length];
}

// The custom properties a numbered mark needs: style object for h().
export function sequenceStyle(i, n) {
  const colour = rampColour(i, n);
  return { "--seq": colour, "--seq-ink": inkOn(colour) };
}
