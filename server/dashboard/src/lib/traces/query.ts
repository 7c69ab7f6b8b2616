/**
 * The query line of the list of traces: free words, and what the service can filter by, as `key:value`. Pure.
 *
 *   friction joint:2 effect:backlash tag:"cold start" source:real outcome:fault kind:ramp after:2026-11-01
 */

export const SOURCES = ['mock', 'real', 'imported'] as const;
export const OUTCOMES = ['complete', 'stopped', 'fault', 'interrupted'] as const;

/** As the service is asked. */
export interface Search {
  q?: string;
  tag?: string;
  source?: (typeof SOURCES)[number];
  outcome?: (typeof OUTCOMES)[number];
  kind?: string;
  joint?: number;
  effect?: string;
  since?: string;
  until?: string;
}

/** What is known and can be completed. */
export interface Known {
  tags: readonly string[];
  kinds: readonly string[];
  joints: readonly number[];
  effects: readonly string[];
}

/** The filters, each as it is used. */
export const EXAMPLES = {
  joint: 'joint:2',
  effect: 'effect:backlash',
  tag: 'tag:cold',
  source: 'source:real',
  outcome: 'outcome:fault',
  kind: 'kind:ramp',
  after: 'after:2026-11-01',
  before: 'before:2026-12-01',
} as const;
type Key = keyof typeof EXAMPLES;
const KEYS = Object.keys(EXAMPLES) as Key[];
const WORD = /(?:(\w+):)?(?:"([^"]*)"?|(\S+))|(\w+):/g;
const EFFECT = /^[a-z]\w*$/;
const DAY = /^\d{4}-\d{2}-\d{2}$/;

/**
 * The search that a line asks for, or in one line what is wrong with it. `joints`: how many the arm has; `effects`: those
 * that are known, if they have been asked for.
 */
export function searchOf(
  line: string,
  joints = 99,
  effects: readonly string[] = [],
): { search: Search; problem: string } {
  const search: Search = {};
  const words: string[] = [];
  const given = new Set<string>();
  let problem = '';
  for (const match of line.matchAll(WORD)) {
    const [whole, key, quoted, plain] = match;
    const { index } = match;
    const value = quoted ?? plain ?? '';
    const half = quoted === undefined ? /^([A-Za-z]\w*):$/.exec(whole)?.[1] : undefined;
    const named = half ?? (key !== undefined && /^[A-Za-z]/.test(key) ? key : undefined);
    if (/^-\w+:/.test(whole)) problem ||= `${whole}: a filter says what is there; nothing can be left out`;
    if (named === undefined) {
      words.push(whole.replaceAll('"', ''));
      continue;
    }
    if (!isKey(named)) {
      problem ||= `${named}: is not a filter; there are ${Object.values(EXAMPLES).join(', ')}. Quotes make it words: "${whole.replaceAll('"', '')}"`;
      continue;
    }
    // The last one is being typed.
    if (half !== undefined) {
      if (index + whole.length < line.trimEnd().length) problem ||= `${half}: needs its value next to it`;
      continue;
    }
    if (given.has(named))
      problem ||= `${named}: can be given once${named === 'joint' ? '; each row of the list says which other joints moved' : ''}`;
    given.add(named);
    problem ||= taken(search, named, value, joints);
    if (named === 'effect' && effects.length > 0 && !effects.includes(value)) {
      const near = effects.filter((one) => one.includes(value.toLowerCase())).join(', ');
      problem ||= `effect: there is no ${value}; ${near ? `there is ${near}` : 'type effect: alone to choose from the list'}`;
    }
  }
  if (words.length > 0) search.q = words.join(' ');
  return { search, problem };
}

function isKey(key: string): key is Key {
  return Object.hasOwn(EXAMPLES, key);
}

/** Adds one filter to `search`. What is wrong with it, if anything. */
function taken(search: Search, key: Key, value: string, joints: number): string {
  const oneOf = <T extends string>(allowed: readonly T[], set: (one: T) => void): string => {
    const found = allowed.find((one) => one === value);
    if (found === undefined) return `${key}: needs one of ${allowed.join(', ')}`;
    set(found);
    return '';
  };
  switch (key) {
    case 'source':
      return oneOf(SOURCES, (one) => (search.source = one));
    case 'outcome':
      return oneOf(OUTCOMES, (one) => (search.outcome = one));
    case 'joint':
      if (!/^[1-9]\d?$/.test(value)) return 'joint: needs a number from 1, such as joint:2';
      if (Number(value) > joints) return `there is no joint ${value}, joints are 1 to ${joints}`;
      search.joint = Number(value);
      return '';
    case 'effect':
      if (!EFFECT.test(value)) return 'effect: needs a name such as coulomb_friction';
      search.effect = value;
      return '';
    case 'after':
    case 'before': {
      const moment = new Date(`${value}T00:00:00`);
      // A 31st of a shorter month would be taken for a day of the next one.
      if (!DAY.test(value) || moment.getDate() !== Number(value.slice(-2)))
        return `${key}: needs a date such as 2026-11-30`;
      search[key === 'after' ? 'since' : 'until'] = moment.toISOString();
      return '';
    }
    default:
      search[key] = value;
      return '';
  }
}

/** Whole lines that complete the last word of a line. */
export function completionsOf(line: string, known: Known): string[] {
  const start = /\S*$/.exec(line)!.index;
  const [before, word] = [line.slice(0, start), line.slice(start)];
  const [key = '', begun] = word.split(':') as [string, string?];
  const values: Partial<Record<string, readonly string[]>> = {
    tag: known.tags,
    source: SOURCES,
    outcome: OUTCOMES,
    kind: known.kinds,
    joint: known.joints.map(String),
    effect: known.effects,
  };
  const found =
    begun === undefined
      ? KEYS.filter((one) => !line.includes(`${one}:`)).map((one) => `${one}:`)
      : (values[key] ?? []).map((one) => withFilter('', key, one));
  return found.filter((one) => one.startsWith(word) && one !== word).map((one) => before + one);
}

/** The line with another filter of this key. */
export function withFilter(line: string, key: string, value: string): string {
  const rest = line.replace(new RegExp(`(^|\\s)${key}:(?:"[^"]*"?|\\S*)`, 'g'), '').trim();
  const filter = `${key}:${/\s/.test(value) ? `"${value}"` : value}`;
  return rest === '' ? filter : `${rest} ${filter}`;
}
