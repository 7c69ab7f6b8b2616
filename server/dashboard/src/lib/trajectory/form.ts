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

/** Whether a joint (from 1) slides: its amplitude, start and speed are lengths. */
export type Slides = (joint: number) => boolean;

const NONE_SLIDES: Slides = () => false;

export interface FormResult {
  /** null while something is wrong with a field. */
  readonly spec: Spec | null;
  /** The same without a name: null only while its motion cannot be told. */
  readonly motion: Spec | null;
  /** By field: `trajectory.duration`, `trajectory.amplitude.2`, `start.1`, `gains.2.0`, `joints`, `name` … */
  readonly problems: Readonly<Record<string, string>>;
}

const LONGEST_NAME = 64;
const NAME = /^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$/;
const GAIN: NumberRule = { bounds: { low: 0, high: 20, above: false }, unit: '', scale: 1, integer: true };
const ANGLE: NumberRule = {
  bounds: { low: -2 * Math.PI, high: 2 * Math.PI, above: false },
  unit: '°',
  scale: DEGREES,
  integer: false,
};

const MILLIMETRES = 1000;

/** A rule of angles as that of a joint: of lengths where it slides, with the same bounds in m. */
function ruleFor(rule: NumberRule, slides: boolean): NumberRule {
  return slides ? { ...rule, unit: rule.unit.replace('°', 'mm'), scale: MILLIMETRES } : rule;
}

/** Whether one number for these joints is a length. Null where some slide and others turn: no number is both. */
export function isLength(joints: readonly number[], slides: Slides): boolean | null {
  const sliding = joints.filter(slides).length;
  return sliding === 0 ? false : sliding === joints.length ? true : null;
}

/** Fields with one number for all joints that is a distance, or a speed. */
const ofJoints = (field: TrajectoryField): boolean => field.name === 'amplitude' || field.name === 'speed';

/** The unit of a field, as people read it. */
export function unitOfField(field: TrajectoryField, joints: readonly number[], slides: Slides): string {
  return ofJoints(field) && isLength(joints, slides) ? field.unit.replace('°', 'mm') : field.unit;
}

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
export function formOf(given: Partial<Spec>, rules: SpecRules, slides: Slides = NONE_SLIDES): SpecForm {
  const spec = { ...rules.standard, ...given } as Spec;
  const kind = rules.kinds.find((one) => one.kind === spec.trajectory.kind);
  const rounded: SpecForm['rounded'] = {};
  const show = (field: string, value: number, scale: number): string => {
    const text = shownNumber(value * scale);
    rounded[field] = { text, value };
    return text;
  };
  const values = valuesOf(kind, spec.trajectory, show, isLength(spec.joints, slides) === true);
  const amplitude = spec.trajectory.amplitude;
  const perJoint = typeof amplitude === 'object' && amplitude !== null;
  const amplitudes: Record<number, string> = {};
  if (perJoint)
    for (const [joint, value] of Object.entries(amplitude as Record<string, number>))
      amplitudes[Number(joint)] = show(
        `trajectory.amplitude.${joint}`,
        value,
        scaleOf(Number(joint), slides),
      );
  return {
    kind: spec.trajectory.kind,
    values,
    perJoint,
    amplitudes,
    joints: [...spec.joints],
    start: Object.fromEntries(
      Object.entries(spec.start ?? {}).map(([joint, angle]) => [
        joint,
        show(`start.${joint}`, angle, scaleOf(Number(joint), slides)),
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

/** What a position of a joint is multiplied with to be shown. */
export function scaleOf(joint: number, slides: Slides): number {
  return slides(joint) ? MILLIMETRES : DEGREES;
}

/**
 * The same form with another kind of trajectory, filled with what is usual for it. A name that a preset or the form gave
 * (`given`: the presets' names) goes with the motion that it named; one that somebody chose stays.
 */
export function withKind(
  form: SpecForm,
  kind: TrajectoryKind,
  given: readonly string[] = [],
  slides: Slides = NONE_SLIDES,
): SpecForm {
  const length = isLength(form.joints, slides) === true;
  const isGiven = [form.kind, ...given].includes(form.name);
  return {
    ...form,
    kind: kind.kind,
    name: isGiven ? kind.kind : form.name,
    values: valuesOf(kind, {}, (_field, value, scale) => shownNumber(value * scale), length),
    perJoint: false,
    amplitudes: {},
    rounded: {},
    kept: null,
  };
}

/** The specification that is in the fields, or what is wrong with them. */
export function specOf(form: SpecForm, rules: SpecRules, slides: Slides = NONE_SLIDES): FormResult {
  const problems: Record<string, string> = {};
  const number = (field: string, text: string, rule: NumberRule): number => {
    const { value, problem } = typedNumber(text, rule);
    if (problem) problems[field] = problem;
    const before = form.rounded[field];
    const isSame = before?.text === text && shownNumber(before.value * rule.scale) === text;
    return value !== null && isSame ? before.value : (value ?? 0);
  };
  const kind = rules.kinds.find((one) => one.kind === form.kind);
  const fields = kind?.fields ?? [];
  if (form.kept === null && isLength(form.joints, slides) === null)
    for (const field of fields)
      if (ofJoints(field) && !(field.type === 'amplitude' && form.perJoint))
        problems[`trajectory.${field.name}`] =
          'some of these joints slide: no number is an angle and a length';
  const trajectory = form.kept ?? trajectoryOf(form, fields, number, slides);
  if (form.joints.length === 0) problems.joints = 'choose at least one joint';
  if (form.name !== '' && !NAME.test(form.name))
    problems.name = 'letters, digits, . _ and - only, no spaces, 64 at most; begin with a letter or a digit';
  const spec: Spec = {
    trajectory,
    joints: [...form.joints].sort((one, other) => one - other),
    start: Object.fromEntries(
      Object.entries(form.start)
        .filter(([, text]) => text.trim() !== '')
        .map(([joint, text]) => [
          joint,
          number(`start.${joint}`, text, ruleFor(ANGLE, slides(Number(joint)))),
        ]),
    ),
    gains: gainsOf(form, number),
    settle: number('settle', form.settle, rules.settle),
    hold: number('hold', form.hold, rules.hold),
    repeats: number('repeats', form.repeats, rules.repeats),
    record: form.record,
    name: form.name === '' ? null : form.name,
    notes: form.notes,
  };
  const wrong = Object.keys(problems);
  return {
    spec: wrong.length === 0 ? spec : null,
    motion: wrong.every((field) => field === 'name') ? { ...spec, name: null } : null,
    problems,
  };
}

/** Where a problem that the service found belongs in the form: `spec.trajectory.ramp.duration` is `trajectory.duration`. */
export function formField(field: string): string {
  const parts = field.split('.');
  if (parts[0] === 'spec') parts.shift();
  if (parts[0] === 'trajectory' && parts.length > 2) parts.splice(1, 1);
  return parts.join('.');
}

/** The name of a form that has changed since it was `before`: with what differs, as `ramp-joint-2-10deg`. */
export function nameOfChanged(
  name: string,
  form: SpecForm,
  before: SpecForm,
  slides: Slides = NONE_SLIDES,
): string {
  const earlier = new Map(piecesOf(before, slides).map(([part, content]) => [part, content]));
  const pieces = piecesOf(form, slides).filter(([part, content]) => earlier.get(part) !== content);
  return [name, ...pieces.map(([, content, word]) => word ?? content)]
    .join('-')
    .replaceAll(',', '.')
    .replaceAll(/[^A-Za-z0-9_.-]+/g, '-')
    .slice(0, LONGEST_NAME);
}

/** What a form asks for, by part: its content, and the word for it where that is another. */
function piecesOf(
  form: SpecForm,
  slides: Slides,
): (readonly [part: string, content: string, word?: string])[] {
  const joints = [...form.joints].sort((one, other) => one - other);
  const { amplitude, ...values } = form.values;
  const sizes = form.perJoint
    ? joints.map((joint) => form.amplitudes[joint] ?? '').join('-')
    : (amplitude ?? '');
  return [
    ['joints', `joint${joints.length === 1 ? '' : 's'}-${joints.join('-')}`],
    ['amplitude', `${sizes}${isLength(joints, slides) ? 'mm' : 'deg'}`],
    ...Object.entries(values).map(
      ([field, text]) => [field, field === 'duration' ? `${text}s` : `${field}-${text}`] as const,
    ),
    ...(['settle', 'hold', 'repeats'] as const).map((field) => [field, `${field}-${form[field]}`] as const),
    ['start', JSON.stringify(Object.entries(form.start).filter(([, text]) => text.trim() !== '')), 'start'],
    [
      'gains',
      JSON.stringify(Object.entries(form.gains).filter(([, gain]) => gain.some((one) => one.trim() !== ''))),
      'gains',
    ],
  ];
}

type ReadNumber = (field: string, text: string, rule: NumberRule) => number;

function trajectoryOf(
  form: SpecForm,
  fields: readonly TrajectoryField[],
  number: ReadNumber,
  slides: Slides,
): Spec['trajectory'] {
  const trajectory: Record<string, unknown> = {};
  for (const field of fields) {
    const rule: NumberRule = { ...field, integer: field.type === 'integer' };
    const text = form.values[field.name] ?? '';
    const name = `trajectory.${field.name}`;
    if (field.type === 'boolean') trajectory[field.name] = text === 'true';
    else if (field.type === 'amplitude' && form.perJoint)
      trajectory[field.name] = Object.fromEntries(
        form.joints.map((joint) => [
          joint,
          number(`${name}.${joint}`, form.amplitudes[joint] ?? '', ruleFor(rule, slides(joint))),
        ]),
      );
    else {
      const length = ofJoints(field) && isLength(form.joints, slides) === true;
      trajectory[field.name] = number(name, text, ruleFor(rule, length));
    }
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
  length: boolean,
): Record<string, string> {
  return Object.fromEntries(
    (kind?.fields ?? []).map((field) => {
      const isLong = length && ofJoints(field);
      // What is usual is meant for joints that turn: 21.6° would be 377 mm.
      const given = trajectory[field.name] ?? (isLong ? null : field.standard);
      const value =
        field.type === 'amplitude' && typeof given !== 'number' && !isLong ? field.standard : given;
      if (field.type === 'boolean') return [field.name, String(value)];
      return [
        field.name,
        typeof value === 'number'
          ? show(`trajectory.${field.name}`, value, isLong ? MILLIMETRES : field.scale)
          : '',
      ];
    }),
  );
}
