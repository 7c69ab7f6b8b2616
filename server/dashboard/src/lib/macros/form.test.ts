import { describe, expect, it } from 'vitest';
import type { Macro } from '../api/types';
import { givenIn } from '../console/completion';
import { fieldsOf, unknownIn, valuesOf, withNamed, withParameter } from './form';

const SCHEMA = {
  properties: {
    amplitude: { type: 'number', title: 'Amplitude', unit: '°', default: 10, minimum: 1, maximum: 30 },
    repeats: { type: 'integer', title: 'Repeats', default: 3, minimum: 1 },
    joints: { type: 'string', title: 'Joints', default: '1-3', enum: ['1-3', '2'] },
    time: { type: 'string', title: 'Time', default: '02:00' },
  },
};
const MACRO: Macro = {
  name: 'mine',
  description: '',
  parameters: [],
  lines: ['run ramp --amplitude 5 --joints 2', 'run ramp --amplitude 7 --repeats 2'],
};

describe('the form of a macro', () => {
  it('has a field of its type for every parameter, with its default', () => {
    const fields = fieldsOf(SCHEMA);
    expect(fields.map((one) => [one.name, one.unit, one.standard])).toEqual([
      ['amplitude', '°', '10'],
      ['repeats', '', '3'],
      ['joints', '', '1-3'],
      ['time', '', '02:00'],
    ]);
    expect(fields[2]!.choices).toEqual(['1-3', '2']);
    expect(fields[3]!.rule).toBeNull();
  });

  it('reads numbers within their bounds and says what is allowed', () => {
    const fields = fieldsOf(SCHEMA);
    expect(valuesOf(fields, { amplitude: '2,5' })).toEqual({
      values: { amplitude: 2.5, repeats: 3, joints: '1-3', time: '02:00' },
      problems: {},
    });
    const { problems } = valuesOf(fields, { amplitude: '31', repeats: '1.5' });
    expect(problems).toEqual({ amplitude: 'allowed: 1 to 30°', repeats: 'a whole number is needed' });
  });
});

describe('a parameter in place of a value', () => {
  it('can be made of a name that was typed in braces', () => {
    const typed = { ...MACRO, lines: ['run ramp --amplitude {amplitude} --joints {which}'] };
    expect(unknownIn(typed)).toEqual(['amplitude', 'which']);
    const made = withNamed(typed, 'amplitude');
    expect(made.parameters[0]).toMatchObject({ name: 'amplitude', type: 'number', unit: '°', default: '' });
    expect(unknownIn(made)).toEqual(['which']);
  });

  it('takes its type, unit and default from the value, and a name that is free', () => {
    const first = withParameter(MACRO, 0, givenIn(MACRO.lines[0]!)[0]!);
    expect(first.lines[0]).toBe('run ramp --amplitude {amplitude} --joints 2');
    expect(first.parameters[0]).toMatchObject({ name: 'amplitude', type: 'number', unit: '°', default: 5 });
    const second = withParameter(first, 1, givenIn(first.lines[1]!)[0]!);
    expect(second.lines[1]).toBe('run ramp --amplitude {amplitude_2} --repeats 2');
    const joints = withParameter(second, 0, givenIn(second.lines[0]!)[0]!);
    expect(joints.parameters[2]).toMatchObject({ name: 'joints', type: 'text', default: '2' });
    const repeats = withParameter(joints, 1, givenIn(joints.lines[1]!)[0]!);
    expect(repeats.parameters[3]).toMatchObject({ type: 'integer', default: 2 });
  });
});
