// How numbers, times and counts are said: three digits at most, time left rather than percent, words for small counts.

const SMALL = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"];

export const plural = (count, one, many = `${one}s`) => `${count} ${count === 1 ? one : many}`;

export const spoken = (count, one, many = `${one}s`) => `${SMALL[count] ?? count} ${count === 1 ? one : many}`;

export const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1);

// Three significant digits, no exponent while the number is readable without one.
export function number(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "-";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1).replace("e+", "e");
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return value.toLocaleString("en", { minimumFractionDigits: 0, maximumFractionDigits: Math.min(6, decimals) });
}

// For columns: the same number of decimals in every row.
export const fixed = (value, decimals = 1) => (Number.isFinite(value) ? value.toFixed(Math.abs(value) >= 1000 ? 0 : decimals).replace(/^-(0(?:\.0+)?)$/, "$1") : "-");

export function timeLeft(seconds) {
  if (seconds === null || seconds === undefined) return "";
  if (seconds < 60) return `${Math.max(1, Math.round(seconds))} s left`;
  return `${Math.floor(seconds / 60)} min ${Math.round(seconds % 60)} s left`;
}

export function ago(stamp, now = Date.now()) {
  if (!stamp) return "";
  const then = new Date(stamp);
  const minutes = Math.round((now - then.getTime()) / 60000);
  if (minutes < 1) return "just now";
  if (minutes < 60) return `${minutes} min ago`;
  if (new Date(now).toDateString() === then.toDateString()) return `at ${then.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" })}`;
  if (new Date(now - 864e5).toDateString() === then.toDateString()) return "yesterday";
  return then.toLocaleDateString("en-GB", { day: "numeric", month: "short" });
}

export function bytes(count) {
  if (count < 1e6) return `${Math.max(1, Math.round(count / 1e3))} kB`;
  return `${number(count / 1e6)} MB`;
}

// How sure an order is: a share of samples. All of them is no certainty; the rule of succession says how near to it they are.
export function sure({ probability, samples = 64 }) {
  if (probability < 1) return `${probability > 0 && probability < 0.01 ? "under 1" : Math.min(99, Math.round(100 * probability))} %`;
  return samples === 0 ? "100 %" : `over ${Math.floor(100 - 100 / (samples + 2))} %`;
}
