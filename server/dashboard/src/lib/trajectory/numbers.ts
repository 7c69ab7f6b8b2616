/** Numbers as they are typed into a form, and what is wrong with them in one line. */

import type { Bounds } from './fields';

export interface Typed {
  readonly value: number | null;
  /** Empty when the text is a number that is allowed. */
  readonly problem: string;
}

export interface NumberRule {
  readonly bounds: Bounds;
  readonly unit: string;
  /** Shown value = value × scale; bounds are those of the value. */
  readonly scale: number;
  readonly integer: boolean;
}

/** A typed number as the specification wants it. A comma is taken for a decimal point. */
export function typedNumber(text: string, rule: NumberRule): Typed {
  const trimmed = text.trim().replace(',', '.');
  if (trimmed === '') return { value: null, problem: `a number is needed: ${allowed(rule)}` };
  const shown = Number(trimmed);
  if (!Number.isFinite(shown))
    return { value: null, problem: `“${text.trim()}” is not a number: ${allowed(rule)}` };
  const value = shown / rule.scale;
  if (rule.integer && !Number.isInteger(shown)) return { value: null, problem: 'a whole number is needed' };
  const { low, high, above } = rule.bounds;
  const slack = 1e-9 * Math.max(1, Math.abs(value));
  const tooLow = low !== null && (above ? value <= low : value < low - slack);
  const tooHigh = high !== null && value > high + slack;
  if (tooLow || tooHigh) return { value: null, problem: `allowed: ${allowed(rule)}` };
  return { value: clamped(value, rule.bounds), problem: '' };
}

/** What may be typed, such as `more than 0 to 3600 s`. */
export function allowed({ bounds, unit, scale }: NumberRule): string {
  const { low, high, above } = bounds;
  const end = unit ? (unit === '°' ? '°' : ` ${unit}`) : '';
  const of = (value: number): string => shownNumber(value * scale).replace('-', '−');
  if (low !== null && high !== null)
    return above ? `more than ${of(low)}, up to ${of(high)}${end}` : `${of(low)} to ${of(high)}${end}`;
  if (low !== null) return `${above ? 'more than' : 'at least'} ${of(low)}${end}`;
  if (high !== null) return `up to ${of(high)}${end}`;
  return `any number${unit ? ` of ${unit}` : ''}`;
}

/** A number for a field: as short as it can be without being another one to six digits. */
export function shownNumber(value: number): string {
  return String(Number(value.toPrecision(6)));
}

/** Degrees that were rounded for being shown must not break the bound they were made from. */
function clamped(value: number, { low, high, above }: Bounds): number {
  if (high !== null && value > high) return high;
  return low !== null && !above && value < low ? low : value;
}
