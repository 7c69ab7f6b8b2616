/** The typed form of a macro, made from the JSON Schema of its parameters. Pure. */

import type { Macro } from '../api/types';
import type { Given } from '../console/completion';
import { boundsOf, type Schema } from '../trajectory/fields';
import { shownNumber, typedNumber, type NumberRule } from '../trajectory/numbers';

/** As much of the schema of a parameter as a form reads. */
type Property = Schema & {
  readonly title?: string;
  readonly unit?: string;
  readonly enum?: readonly string[];
};

export interface MacroField {
  readonly name: string;
  readonly label: string;
  readonly unit: string;
  /** Empty unless one of a list is to be chosen. */
  readonly choices: readonly string[];
  /** null for a text. */
  readonly rule: NumberRule | null;
  readonly standard: string;
}

type Value = string | number | boolean;

/** The fields, in the order of the parameters. */
export function fieldsOf(schema: Readonly<Record<string, unknown>>): MacroField[] {
  const properties = (schema['properties'] ?? {}) as Readonly<Record<string, Property>>;
  return Object.entries(properties).map(([name, one]) => {
    const isNumber = one.type === 'number' || one.type === 'integer';
    const constant = one.const === undefined ? [] : [String(one.const)];
    return {
      name,
      label: one.title ?? name,
      unit: one.unit ?? '',
      choices: one.enum ?? constant,
      rule: isNumber
        ? { bounds: boundsOf(one), unit: one.unit ?? '', scale: 1, integer: one.type === 'integer' }
        : null,
      standard: typeof one.default === 'number' ? shownNumber(one.default) : String(one.default ?? ''),
    };
  });
}

/** What was typed, as the service wants it, and what is wrong with it by field. */
export function valuesOf(
  fields: readonly MacroField[],
  typed: Readonly<Record<string, string>>,
): { values: Record<string, Value>; problems: Record<string, string> } {
  const values: Record<string, Value> = {};
  const problems: Record<string, string> = {};
  for (const { name, rule, standard } of fields) {
    const text = typed[name] ?? standard;
    if (rule === null) {
      values[name] = text;
      continue;
    }
    const { value, problem } = typedNumber(text, rule);
    if (problem) problems[name] = problem;
    else values[name] = value ?? 0;
  }
  return { values, problems };
}

/** Names in braces that lines have and no parameter is called. */
export function unknownIn(macro: Pick<Macro, 'lines' | 'parameters'>): string[] {
  const known = new Set(macro.parameters.map((one) => one.name));
  const named = macro.lines.flatMap((line) =>
    [...line.matchAll(/\{([a-z][a-z0-9_]*)\}/g)].map((one) => one[1]!),
  );
  return [...new Set(named)].filter((name) => !known.has(name));
}

/** The macro with a parameter of this name, whose default is still to be typed. */
export function withNamed(macro: Macro, name: string): Macro {
  return { ...macro, parameters: [...macro.parameters, parameterOf(name, name, '')] };
}

/** The macro with a parameter in place of a value of one of its lines. */
export function withParameter(macro: Macro, line: number, given: Given): Macro {
  const taken = new Set(macro.parameters.map((one) => one.name));
  let name = given.name;
  for (let more = 2; taken.has(name); more++) name = `${given.name}_${more}`;
  const text = macro.lines[line] ?? '';
  const lines = macro.lines.with(
    line,
    `${text.slice(0, given.at)}{${name}}${text.slice(given.at + given.value.length)}`,
  );
  return { ...macro, lines, parameters: [...macro.parameters, parameterOf(name, given.name, given.value)] };
}

/** A parameter for a value of this option. Nothing yet is taken for a number where the option has a unit. */
function parameterOf(name: string, option: string, value: string): Macro['parameters'][number] {
  const number = Number(value);
  const isNumber =
    value === '' ? option in UNITS || WHOLE.has(option) : Number.isFinite(number) && option !== 'joints';
  return {
    name,
    title: '',
    unit: UNITS[option] ?? '',
    type: !isNumber ? 'text' : WHOLE.has(option) ? 'integer' : 'number',
    default: isNumber && value !== '' ? number : value,
    minimum: null,
    maximum: null,
    choices: [],
  };
}

/** Units that the lines of `run` expect. */
const UNITS: Readonly<Record<string, string>> = {
  amplitude: '°',
  phase: '°',
  speed: '°/s',
  duration: 's',
  period: 's',
  dwell: 's',
  settle: 's',
  hold: 's',
  lowest: 'Hz',
  highest: 'Hz',
};
const WHOLE = new Set(['repeats', 'steps', 'reversals', 'tones', 'seed']);
