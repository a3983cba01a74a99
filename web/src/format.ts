// Numbers as an engineer reads them: three significant digits, SI prefixes, units.

const kThin = "\u2009";
const kPrefixes: [number, string][] = [
  [1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"], [1e-15, "f"],
]; // prettier-ignore
// Units that take prefixes, with the scale to the unit without one.
const kPrefixable: Record<string, [number, string]> = {
  m: [1, "m"], J: [1, "J"], s: [1, "s"], us: [1e-6, "s"], ms: [1e-3, "s"], ns: [1e-9, "s"], rad: [1, "rad"], N: [1, "N"], Nm: [1, "Nm"],
}; // prettier-ignore

const kSuperscripts: Record<string, string> = {
  "-": "⁻", "0": "⁰", "1": "¹", "2": "²", "3": "³", "4": "⁴", "5": "⁵", "6": "⁶", "7": "⁷", "8": "⁸", "9": "⁹",
}; // prettier-ignore

// What a length below says is that it is below; an angle alike (least_quantity in src/base/quantity.h).
const kResolution: Record<string, number> = { m: 1e-12, rad: 1e-12 };

export function belowFloor(value: number, unit: string): boolean {
  return value !== 0 && Math.abs(value) < (kResolution[unit] ?? 0) * (1 - 1e-9);
}

// "below 1 pm"
export function floorText(unit: string): string {
  return `below ${quantity(kResolution[unit] ?? 0, unit, 1)}`;
}

export function superscript(exponent: number): string {
  return String(exponent).replace(/[-0-9]/g, (digit) => kSuperscripts[digit] ?? digit);
}

function groupThousands(text: string): string {
  const [whole = "", part] = text.split(".");
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, kThin) : whole;
  return part === undefined ? grouped : `${grouped}.${part}`;
}

// `digits` significant digits without an exponent.
export function plain(value: number, digits = 3): string {
  if (value === 0) return "0";
  const magnitude = Math.floor(Math.log10(Math.abs(Number(value.toPrecision(digits)))));
  const rounded = Number(value.toPrecision(digits));
  const text = rounded.toFixed(Math.max(0, digits - 1 - magnitude));
  return groupThousands(text.replace("-", "−"));
}

// Mantissa in [1, 1000) and an exponent that is a multiple of three.
export function powerOfTen(value: number, digits = 3): string {
  if (value === 0) return "0";
  const rounded = Number(value.toPrecision(digits));
  const exponent = Math.floor(Math.log10(Math.abs(rounded)) / 3 + 1e-9) * 3;
  if (exponent === 0) return plain(rounded, digits);
  return `${plain(rounded / 10 ** exponent, digits)}${kThin}×${kThin}10${superscript(exponent)}`;
}

// A figure in as little room as it needs: with an SI prefix where its unit takes one, else without unit.
export function brief(value: number | null, unit: string): string {
  if (value === null || !Number.isFinite(value)) return "";
  if (kPrefixable[unit]) return quantity(value, unit, 2);
  const size = Math.abs(value);
  if (size === 0 || (size >= 1e-3 && size < 1e4)) return plain(value, 2);
  const exponent = Math.floor(Math.log10(Math.abs(Number(value.toPrecision(2)))) + 1e-9);
  return `${plain(value / 10 ** exponent, 2)}×10${superscript(exponent)}`;
}

export function unitText(unit: string): string {
  if (unit === "1" || unit === "") return "";
  if (unit === "us") return "µs";
  return unit.replace(/\^(-?\d+)/g, (_, exponent: string) => superscript(Number(exponent)));
}

// The unit stands in every figure already.
export function hasPrefixes(unit: string): boolean {
  return unit in kPrefixable;
}

// "4.34 mm", "1030 kHz", "2.1 × 10⁻⁶ kg m²/s"; "–" for what is missing.
export function quantity(value: number | null | undefined, unit: string, digits = 3): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const scaled = kPrefixable[unit];
  if (belowFloor(value, unit)) return floorText(unit);
  if (scaled) {
    const inUnit = value * scaled[0];
    if (inUnit === 0) return `0 ${scaled[1]}`;
    const rounded = Math.abs(Number(inUnit.toPrecision(digits)));
    for (const [factor, prefix] of kPrefixes) {
      if (rounded >= factor * (1 - 1e-12)) {
        if (rounded / factor >= 1000) break;
        return `${plain(inUnit / factor, digits)} ${prefix}${scaled[1]}`;
      }
    }
    return `${powerOfTen(inUnit, digits)} ${scaled[1]}`;
  }
  const suffix = unitText(unit);
  const size = Math.abs(value);
  const text = size === 0 || (size >= 1e-3 && size < 1e6) ? plain(value, digits) : powerOfTen(value, digits);
  return suffix ? `${text} ${suffix}` : text;
}

export function realtime(value: number | null | undefined): string {
  return value === null || value === undefined || !Number.isFinite(value) ? "–" : `${quantity(value, "1")}×`;
}

// A value of this name with its unit; realtime factors are written with a times sign.
export function named(name: string, value: number | null | undefined, unit: string): string {
  return name === "realtime_factor" ? realtime(value) : quantity(value, unit);
}

const kWithUnit = new RegExp(`(\\d) ?(?=(?:${kPrefixes.map(([, prefix]) => prefix).join("|")})(?:${[...new Set(Object.values(kPrefixable).map(([, unit]) => unit))].join("|")})(?![\\w-]))`, "g");

// A text that no line breaks between a number and its unit.
export function unbroken(text: string): string {
  return text.replace(kWithUnit, "$1\u00a0");
}

// A value that may be an upper bound, which what is below the floor is in any case.
export function bounded(name: string, value: number | null, unit: string, bound: boolean | undefined): string {
  return (bound && !belowFloor(value ?? 0, unit) ? "≤ " : "") + named(name, value, unit);
}

// A stored value.
export function figure(value: { name: string; value: number | null; unit: string; bound?: boolean }): string {
  return bounded(value.name, value.value, value.unit, value.bound);
}

export function interval(name: string, low: number | null, high: number | null, unit: string): string {
  if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return "";
  return `${named(name, low, unit)} to ${named(name, high, unit)}`;
}

// Milliseconds of a power-of-two timestep: 1/64, 4, 0.3.
export function timestep(ms: number): string {
  if (ms > 0 && ms < 1) {
    const inverse = 1 / ms;
    if (Math.abs(inverse - Math.round(inverse)) < 1e-9 && Number.isInteger(Math.log2(Math.round(inverse)))) {
      return `1/${Math.round(inverse)}`;
    }
  }
  return String(Number(ms.toPrecision(6)));
}

// "1/64 to 4 ms"
export function timestepRange(steps: number[]): string {
  const sorted = [...steps].sort((a, b) => a - b);
  const first = sorted[0];
  const last = sorted[sorted.length - 1];
  if (first === undefined || last === undefined) return "";
  return first === last ? `${timestep(first)} ms` : `${timestep(first)} to ${timestep(last)} ms`;
}

export function seconds(value: number | null): string {
  return quantity(value, "s");
}

export function percent(share: number | null): string {
  return share === null || !Number.isFinite(share) ? "–" : `${plain(share * 100, 2)} %`;
}

// A device's name without its driver, which the manifest has.
export function deviceName(text: string): string {
  return text.replace(/, driver .*$/, "");
}

export function counted(count: number, one: string): string {
  return `${count} ${one}${count === 1 ? "" : "s"}`;
}

export function sentenceList(words: string[]): string {
  if (words.length < 2) return words.join("");
  return `${words.slice(0, -1).join(", ")} and ${words[words.length - 1]}`;
}
