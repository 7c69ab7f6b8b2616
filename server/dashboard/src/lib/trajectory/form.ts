/** The form of an experiment: between the text that is typed and the specification that is sent. */

import { boundsOf, DEGREES, kindsOf, type Schema, type TrajectoryField, type TrajectoryKind } from './fields';
import { shownNumber, typedNumber, type NumberRule } from './numbers';

/** As much of a specification as a form reads; angles in rad. */
export interface Spec {
  readonly trajectory: Readonly<Record<string, unknown>> & { readonly kind: string };
  readonly joints: readonly number[];
  readonly start?: Readonly<Record<string, number>>;
  readonly gains?: Readonly<Record<string, readonly number[]>>;
  readonly settle: number;
  readonly hold: number;
  readonly repeats: number;
  readonly record?: readonly number[] | null;
  readonly name?: string | null;
  readonly operator?: string | null;
  readonly notes?: string;
}

/** What is in the fields. Everything that is typed stays text until it is sent. */
export interface SpecForm {
  kind: string;
  /** By the name of the trajectory's field; `true` or `false` for a switch. */
  values: Record<string, string>;
  perJoint: boolean;
  /** By joint, for an amplitude that differs from joint to joint. */
  amplitudes: Record<number, string>;
  joints: number[];
  /** By joint; empty for the rest posture. */
  start: Record<number, string>;
  /** By joint: P, I, D; all empty to leave them as they are. */
  gains: Record<number, [string, string, string]>;
  settle: string;
  hold: string;
  repeats: string;
  name: string;
  notes: string;
  /** By field, as in the problems: the number that its text was rounded from. It counts until something else is typed. */
  rounded: Record<string, { readonly text: string; readonly value: number }>;
  /** A trajectory that has no form, kept as it is. */
  kept: Spec['trajectory'] | null;
  /** Fields of the specification that the form does not show. */
  record: readonly number[] | null;
}

/** What the form knows of the rules. */
export interface SpecRules {
  readonly kinds: readonly TrajectoryKind[];
  readonly settle: NumberRule;
  readonly hold: NumberRule;
  readonly repeats: NumberRule;
  /** What a specification has where nothing is said. */
  readonly standard: Readonly<Record<string, unknown>>;
}

export interface FormResult {
  /** null while something is wrong with a field. */
  readonly spec: Spec | null;
  /** By field: `trajectory.duration`, `trajectory.amplitude.2`, `start.1`, `gains.2.0`, `joints`, `name` … */
  readonly problems: Readonly<Record<string, string>>;
}

const NAME = /^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$/;
const GAIN: NumberRule = { bounds: { low: 0, high: 20, above: false }, unit: '', scale: 1, integer: true };
const ANGLE: NumberRule = {
  bounds: { low: -2 * Math.PI, high: 2 * Math.PI, above: false },
  unit: '°',
  scale: DEGREES,
  integer: false,
};

export function rulesOf(schema: Schema): SpecRules {
  const properties = schema.properties ?? {};
  const rule = (name: string, unit: string): NumberRule => ({
    bounds: boundsOf(properties[name] ?? {}),
    unit,
    scale: 1,
    integer: properties[name]?.type === 'integer',
  });
  const withDefault = Object.entries(properties).filter(([, property]) => property.default !== undefined);
  return {
    kinds: kindsOf(schema),
    settle: rule('settle', 's'),
    hold: rule('hold', 's'),
    repeats: rule('repeats', ''),
    standard: Object.fromEntries(withDefault.map(([name, property]) => [name, property.default])),
  };
}

/** The fields filled with a specification; what it leaves out is as usual. */
export function formOf(given: Partial<Spec>, rules: SpecRules): SpecForm {
  const spec = { ...rules.standard, ...given } as Spec;
  const kind = rules.kinds.find((one) => one.kind === spec.trajectory.kind);
  const rounded: SpecForm['rounded'] = {};
  const show = (field: string, value: number, scale: number): string => {
    const text = shownNumber(value * scale);
    rounded[field] = { text, value };
    return text;
  };
  const values = valuesOf(kind, spec.trajectory, show);
  const amplitude = spec.trajectory.amplitude;
  const perJoint = typeof amplitude === 'object' && amplitude !== null;
  const amplitudes: Record<number, string> = {};
  if (perJoint)
    for (const [joint, value] of Object.entries(amplitude as Record<string, number>))
      amplitudes[Number(joint)] = show(`trajectory.amplitude.${joint}`, value, DEGREES);
  return {
    kind: spec.trajectory.kind,
    values,
    perJoint,
    amplitudes,
    joints: [...spec.joints],
    start: Object.fromEntries(
      Object.entries(spec.start ?? {}).map(([joint, angle]) => [
        joint,
        show(`start.${joint}`, angle, DEGREES),
      ]),
    ),
    gains: Object.fromEntries(
      Object.entries(spec.gains ?? {}).map(([joint, gain]) => [
        joint,
        gain.map(String) as [string, string, string],
      ]),
    ),
    settle: show('settle', spec.settle, 1),
    hold: show('hold', spec.hold, 1),
    repeats: String(spec.repeats),
    name: spec.name ?? '',
    notes: spec.notes ?? '',
    rounded,
    kept: kind && kind.fields.length > 0 ? null : spec.trajectory,
    record: spec.record ?? null,
  };
}

/**
 * The same form with another kind of trajectory, filled with what is usual for it. A name that a preset or the form gave
 * (`given`: the presets' names) goes with the motion that it named; one that somebody chose stays.
 */
export function withKind(form: SpecForm, kind: TrajectoryKind, given: readonly string[] = []): SpecForm {
  const isGiven = [form.kind, ...given].includes(form.name);
  return {
    ...form,
    kind: kind.kind,
    name: isGiven ? kind.kind : form.name,
    values: valuesOf(kind, {}, (_field, value, scale) => shownNumber(value * scale)),
    perJoint: false,
    amplitudes: {},
    rounded: {},
    kept: null,
  };
}

/** The specification that is in the fields, or what is wrong with them. */
export function specOf(form: SpecForm, rules: SpecRules): FormResult {
  const problems: Record<string, string> = {};
  const number = (field: string, text: string, rule: NumberRule): number => {
    const { value, problem } = typedNumber(text, rule);
    if (problem) problems[field] = problem;
    const before = form.rounded[field];
    return value !== null && before?.text === text ? before.value : (value ?? 0);
  };
  const kind = rules.kinds.find((one) => one.kind === form.kind);
  const trajectory = form.kept ?? trajectoryOf(form, kind?.fields ?? [], number);
  if (form.joints.length === 0) problems.joints = 'choose at least one joint';
  if (form.name !== '' && !NAME.test(form.name))
    problems.name = 'letters, digits, and . _ - inside, 64 at most';
  const spec: Spec = {
    trajectory,
    joints: [...form.joints].sort((one, other) => one - other),
    start: Object.fromEntries(
      Object.entries(form.start)
        .filter(([, text]) => text.trim() !== '')
        .map(([joint, text]) => [joint, number(`start.${joint}`, text, ANGLE)]),
    ),
    gains: gainsOf(form, number),
    settle: number('settle', form.settle, rules.settle),
    hold: number('hold', form.hold, rules.hold),
    repeats: number('repeats', form.repeats, rules.repeats),
    record: form.record,
    name: form.name === '' ? null : form.name,
    notes: form.notes,
  };
  return { spec: Object.keys(problems).length === 0 ? spec : null, problems };
}

/** Where a problem that the service found belongs in the form: `spec.trajectory.ramp.duration` is `trajectory.duration`. */
export function formField(field: string): string {
  const parts = field.split('.');
  if (parts[0] === 'spec') parts.shift();
  if (parts[0] === 'trajectory' && parts.length > 2) parts.splice(1, 1);
  return parts.join('.');
}

type ReadNumber = (field: string, text: string, rule: NumberRule) => number;

function trajectoryOf(
  form: SpecForm,
  fields: readonly TrajectoryField[],
  number: ReadNumber,
): Spec['trajectory'] {
  const trajectory: Record<string, unknown> = {};
  for (const field of fields) {
    const rule: NumberRule = { ...field, integer: field.type === 'integer' };
    const text = form.values[field.name] ?? '';
    const name = `trajectory.${field.name}`;
    if (field.type === 'boolean') trajectory[field.name] = text === 'true';
    else if (field.type === 'amplitude' && form.perJoint)
      trajectory[field.name] = Object.fromEntries(
        form.joints.map((joint) => [joint, number(`${name}.${joint}`, form.amplitudes[joint] ?? '', rule)]),
      );
    else trajectory[field.name] = number(name, text, rule);
  }
  return { kind: form.kind, ...trajectory };
}

function gainsOf(form: SpecForm, number: ReadNumber): Record<string, number[]> {
  const typed = Object.entries(form.gains).filter(([, gain]) => gain.some((text) => text.trim() !== ''));
  return Object.fromEntries(
    typed.map(([joint, gain]) => [
      joint,
      gain.map((text, place) => number(`gains.${joint}.${place}`, text, GAIN)),
    ]),
  );
}

function valuesOf(
  kind: TrajectoryKind | undefined,
  trajectory: Readonly<Record<string, unknown>>,
  show: (field: string, value: number, scale: number) => string,
): Record<string, string> {
  return Object.fromEntries(
    (kind?.fields ?? []).map((field) => {
      const given = trajectory[field.name] ?? field.standard;
      const value = field.type === 'amplitude' && typeof given !== 'number' ? field.standard : given;
      if (field.type === 'boolean') return [field.name, String(value)];
      return [
        field.name,
        typeof value === 'number' ? show(`trajectory.${field.name}`, value, field.scale) : '',
      ];
    }),
  );
}
