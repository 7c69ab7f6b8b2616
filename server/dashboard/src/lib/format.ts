/** Numbers as they are shown: a fixed number of digits, a true minus sign, and nothing where there is nothing. */

export const NOTHING = '–';

/** `value` with `digits` decimals; never "−0.0". */
export function fixed(value: number | null | undefined, digits: number): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return NOTHING;
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace('-', '') : text.replace('-', '−');
}

/** About `digits` significant digits, for values of any size. */
export function significant(value: number | null | undefined, digits = 3): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return NOTHING;
  if (value === 0) return '0';
  const size = Math.floor(Math.log10(Math.abs(value)));
  if (size < -4 || size >= 6)
    return value
      .toExponential(digits - 1)
      .replace(/-/g, '−')
      .replace('e+', 'e');
  return fixed(value, Math.max(0, digits - 1 - size));
}

/** The same without zeros at its end, where numbers stand alone. */
export function shortest(value: number | null | undefined, digits = 3): string {
  return significant(value, digits).replace(/\.0+(?=e|$)|(\.\d*[1-9])0+(?=e|$)/, '$1');
}

const BYTES = ['B', 'kB', 'MB', 'GB', 'TB'] as const;

/** A number of bytes: 1.2 GB. */
export function bytes(value: number | null | undefined): string {
  if (value === null || value === undefined) return NOTHING;
  const power = Math.min(BYTES.length - 1, value < 1 ? 0 : Math.floor(Math.log10(value) / 3));
  return `${shortest(value / 1000 ** power, 3)} ${BYTES[power] ?? 'B'}`;
}

/** A duration in s: 0.42 s, 12.3 s, 3 min 20 s, 2 h 05 min, 3 d 4 h. */
export function duration(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return NOTHING;
  if (seconds < 60) return `${seconds < 10 ? fixed(seconds, 2) : fixed(seconds, 1)} s`;
  const whole = Math.round(seconds);
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  const minutes = Math.floor(whole / 60);
  if (whole < 86400) return `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, '0')} min`;
  return `${Math.floor(whole / 86400)} d ${Math.floor((whole % 86400) / 3600)} h`;
}

/** The same in whole seconds or minutes, for what is waited for or only about so long. */
export function coarse(seconds: number): string {
  if (seconds < 60) return `${Math.round(seconds)} s`;
  return seconds < 3600 ? `${Math.floor(seconds / 60)} min` : duration(seconds);
}

const TIME = new Intl.DateTimeFormat('en-GB', { hour: '2-digit', minute: '2-digit', second: '2-digit' });
const DAY = new Intl.DateTimeFormat('en-GB', { day: '2-digit', month: 'short' });
const MINUTE = {
  day: '2-digit',
  month: 'short',
  year: 'numeric',
  hour: '2-digit',
  minute: '2-digit',
} as const;
const DAY_AND_TIME = new Intl.DateTimeFormat('en-GB', MINUTE);
const DAY_AND_SECOND = new Intl.DateTimeFormat('en-GB', { ...MINUTE, second: '2-digit' });

/** The time of day of an ISO moment, in this computer's time zone; of another day than `now` (ms) with that day. */
export function timeOfDay(moment: string, now = Date.now()): string {
  const at = new Date(moment);
  const isToday = at.toDateString() === new Date(now).toDateString();
  return isToday ? TIME.format(at) : `${DAY.format(at)}, ${TIME.format(at)}`;
}

/** Day and time of an ISO moment, in this computer's time zone. */
export function dayAndTime(moment: string): string {
  return DAY_AND_TIME.format(new Date(moment));
}

/** The same to the second. */
export function dayAndSecond(moment: string): string {
  return DAY_AND_SECOND.format(new Date(moment));
}

/** The text with a capital first letter. */
export function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** Who a caller is, in a sentence: `local` is the service's name for those who need none. */
export function spoken(name: string | null): string {
  return name === null ? 'somebody' : name === 'local' ? 'somebody at the service’s computer' : name;
}

/** A one-line message of the service with a capital letter and a full stop, % kept with its number; empty stays so. */
export function sentence(text: string): string {
  const whole = text.trim();
  if (whole === '') return '';
  const first = capital(whole).replace(/(\d) %/g, '$1\u00a0%');
  return /[.!?]$/.test(first) ? first : `${first}.`;
}

/** The time zone of this browser, by which times of day are shown and entered. */
export const ZONE = Intl.DateTimeFormat().resolvedOptions().timeZone;
