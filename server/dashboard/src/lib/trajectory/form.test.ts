import { describe, expect, it } from 'vitest';
import type { Schema } from './fields';
import { formField, formOf, nameOfChanged, rulesOf, specOf, unitOfField, withKind, type Spec } from './form';

const number = (more: Schema): Schema => ({ type: 'number', ...more });
const amplitude: Schema = {
  anyOf: [number({ minimum: -2 * Math.PI, maximum: 2 * Math.PI }), { type: 'object' }],
  default: 0.3769911184307752,
};
const SCHEMA: Schema = {
  $defs: {
    Cubic: { properties: { kind: { const: 'cubic' }, amplitude } },
    Ramp: {
      description: 'Equal small increments through `amplitude`,\nall joints together.\n\nMore.',
      properties: {
        kind: { const: 'ramp' },
        amplitude,
        duration: number({ exclusiveMinimum: 0, maximum: 3600, default: 0.65 }),
      },
    },
    Staircase: {
      properties: {
        kind: { const: 'staircase' },
        steps: { type: 'integer', minimum: 1, maximum: 200, default: 8 },
        back: { type: 'boolean', default: true },
      },
    },
    Sequence: { properties: { kind: { const: 'sequence' }, segments: { type: 'array' } } },
  },
  properties: {
    trajectory: {
      discriminator: {
        mapping: {
          ramp: '#/$defs/Ramp',
          sequence: '#/$defs/Sequence',
          staircase: '#/$defs/Staircase',
          cubic: '#/$defs/Cubic',
        },
      },
    },
    settle: number({ minimum: 0, maximum: 3600, default: 0.5 }),
    hold: number({ minimum: 0, maximum: 3600 }),
    repeats: { type: 'integer', minimum: 1, maximum: 1000 },
  },
};
const RULES = rulesOf(SCHEMA);
const RAMP: Spec = {
  trajectory: { kind: 'ramp', amplitude: 0.3769911184307752, duration: 0.65 },
  joints: [1, 2, 3],
  start: {},
  gains: {},
  settle: 0.5,
  hold: 2,
  repeats: 1,
  record: null,
  name: 'ramp',
  notes: '',
};

describe('kinds of trajectories', () => {
  it('are those of the schema, in its order, with its bounds', () => {
    expect(RULES.kinds.map((kind) => kind.kind)).toEqual(['cubic', 'ramp', 'staircase', 'sequence']);
    const ramp = RULES.kinds[1]!;
    expect(ramp.description).toBe('Equal small increments through amplitude, all joints together.');
    expect(ramp.fields.map((field) => [field.label, field.unit, field.type])).toEqual([
      ['Amplitude', '°', 'amplitude'],
      ['Duration', 's', 'number'],
    ]);
    expect(ramp.fields[1]!.bounds).toEqual({ low: 0, high: 3600, above: true });
  });
});

describe('a form filled with a specification', () => {
  it('shows degrees and gives the same specification back', () => {
    const form = formOf(RAMP, RULES);
    expect(form.values).toEqual({ amplitude: '21.6', duration: '0.65' });
    const { spec } = specOf(form, RULES);
    expect(spec!.trajectory.amplitude).toBeCloseTo(0.3769911184307752, 12);
    expect({ ...spec, trajectory: null }).toEqual({ ...RAMP, trajectory: null });
  });

  it('keeps amplitudes, start and gains of single joints', () => {
    const given: Spec = {
      ...RAMP,
      trajectory: { kind: 'ramp', amplitude: { 1: Math.PI / 2, 3: -Math.PI / 6 }, duration: 2 },
      joints: [1, 3],
      start: { 2: Math.PI / 4 },
      gains: { 1: [2, 0, 1] },
    };
    const form = formOf(given, RULES);
    expect(form.amplitudes).toEqual({ 1: '90', 3: '-30' });
    const { spec } = specOf(form, RULES);
    expect(spec!.trajectory.amplitude).toEqual({ 1: Math.PI / 2, 3: expect.closeTo(-Math.PI / 6, 12) });
    expect([spec!.start, spec!.gains]).toEqual([{ 2: Math.PI / 4 }, { 1: [2, 0, 1] }]);
  });

  it('gives back to the bit what it shows rounded, until something else is typed', () => {
    const given: Spec = {
      ...RAMP,
      trajectory: { kind: 'ramp', amplitude: { 1: 0.05, 3: 0.1 }, duration: 0.1234567 },
      joints: [1, 3],
      start: { 2: 0.7 },
      settle: 1 / 3,
    };
    const form = formOf(given, RULES);
    expect(form.amplitudes).toEqual({ 1: '2.86479', 3: '5.72958' });
    expect(specOf(form, RULES).spec).toEqual(given);
    const typed = specOf({ ...form, start: { 2: '40' } }, RULES).spec!;
    expect(typed.start![2]).toBeCloseTo((40 * Math.PI) / 180, 12);
  });

  it('fills in what is usual where nothing is said', () => {
    const { settle, ...without } = RAMP;
    expect([settle, formOf(without, RULES).settle]).toEqual([0.5, '0.5']);
  });

  it('gives no motion the name of another, and keeps a name that somebody chose', () => {
    const form = formOf(RAMP, RULES);
    const cubic = RULES.kinds[0]!;
    expect(withKind({ ...form, name: 'ramp' }, cubic).name).toBe('cubic');
    expect(withKind({ ...form, name: 'diagnostic-c' }, cubic, ['diagnostic-c']).name).toBe('cubic');
    expect(withKind({ ...form, name: 'monday' }, cubic, ['diagnostic-c']).name).toBe('monday');
    expect(withKind({ ...form, name: '' }, cubic).name).toBe('');
  });

  it('keeps a sequence as it is', () => {
    const sequence = { kind: 'sequence', segments: [{ move: { kind: 'pause', duration: 1 } }] };
    const form = formOf({ ...RAMP, trajectory: sequence }, RULES);
    expect(specOf(form, RULES).spec!.trajectory).toBe(sequence);
    expect(specOf(withKind(form, RULES.kinds[2]!), RULES).spec!.trajectory).toEqual({
      kind: 'staircase',
      steps: 8,
      back: true,
    });
  });
});

describe('what is wrong with what is typed', () => {
  it('is told at its field, in the unit that is shown', () => {
    const form = formOf(RAMP, RULES);
    const problems = specOf(
      {
        ...form,
        values: { amplitude: '400', duration: '0' },
        repeats: '1.5',
        hold: '',
        name: 'a b',
        joints: [],
      },
      RULES,
    ).problems;
    expect(problems).toEqual({
      'trajectory.amplitude': 'allowed: −360 to 360°',
      'trajectory.duration': 'allowed: more than 0, up to 3600 s',
      repeats: 'a whole number is needed',
      hold: 'a number is needed: 0 to 3600 s',
      name: 'letters, digits, . _ and - only, no spaces, 64 at most; begin with a letter or a digit',
      joints: 'choose at least one joint',
    });
  });

  it('is found for one joint alone', () => {
    const form = { ...formOf(RAMP, RULES), perJoint: true, amplitudes: { 1: '10', 2: 'x', 3: '5,5' } };
    const { spec, problems } = specOf(form, RULES);
    expect(spec).toBeNull();
    expect(Object.keys(problems)).toEqual(['trajectory.amplitude.2']);
    expect(problems['trajectory.amplitude.2']).toBe('“x” is not a number: −360 to 360°');
  });

  it('allows the very bounds, typed in degrees', () => {
    const form = { ...formOf(RAMP, RULES), values: { amplitude: '360', duration: '3600' } };
    expect(specOf(form, RULES).spec!.trajectory).toEqual({
      kind: 'ramp',
      amplitude: 2 * Math.PI,
      duration: 3600,
    });
  });

  it('is put where it belongs when the service finds it', () => {
    expect(formField('spec.trajectory.ramp.duration')).toBe('trajectory.duration');
    expect(formField('spec.trajectory.ramp.amplitude')).toBe('trajectory.amplitude');
    expect(formField('spec.gains.1.0')).toBe('gains.1.0');
    expect(formField('at')).toBe('at');
  });
});

describe('joints that slide', () => {
  const first = (joint: number): boolean => joint === 1;
  const given: Spec = {
    ...RAMP,
    trajectory: { kind: 'ramp', amplitude: { 1: 0.03, 2: 0.3769911184307752 }, duration: 0.65 },
    joints: [1, 2],
    start: { 1: 0.1 },
  };

  it('are typed in millimetres, and give the same specification back', () => {
    const form = formOf(given, RULES, first);
    expect([form.amplitudes, form.start]).toEqual([{ 1: '30', 2: '21.6' }, { 1: '100' }]);
    expect(specOf(form, RULES, first).spec).toEqual(given);
    const typed = specOf({ ...form, amplitudes: { 1: '21.6', 2: '21.6' } }, RULES, first).spec!;
    const { 1: slide, 2: turn } = typed.trajectory['amplitude'] as Record<number, number>;
    expect(slide).toBeCloseTo(0.0216);
    expect(turn).toBeCloseTo(0.377, 4);
  });

  it('share no number with joints that turn', () => {
    const form = { ...formOf(RAMP, RULES, first), joints: [1, 2] };
    const { spec, problems } = specOf(form, RULES, first);
    expect(spec).toBeNull();
    expect(problems['trajectory.amplitude']).toContain('some of these joints slide');
  });

  it('take no degrees of another joint for their own', () => {
    const form = { ...formOf({ ...RAMP, joints: [2] }, RULES, first), joints: [1] };
    expect(unitOfField(RULES.kinds[1]!.fields[0]!, form.joints, first)).toBe('mm');
    expect(specOf(form, RULES, first).spec!.trajectory['amplitude']).toBeCloseTo(0.0216);
    expect(withKind(form, RULES.kinds[1]!, [], first).values['amplitude']).toBe('');
  });
});

it('a form that has changed is named after what differs', () => {
  const before = formOf(RAMP, RULES);
  const named = (more: Partial<Spec>): string =>
    nameOfChanged('ramp', formOf({ ...RAMP, ...more }, RULES), before);
  expect(named({})).toBe('ramp');
  expect(named({ joints: [2] })).toBe('ramp-joint-2');
  const trajectory = { kind: 'ramp', amplitude: { 1: 0.1 * Math.PI, 3: -0.05 * Math.PI }, duration: 1.5 };
  expect(named({ joints: [1, 3], trajectory, gains: { 2: [1, 2, 3] } })).toBe(
    'ramp-joints-1-3-18--9deg-1.5s-gains',
  );
});
