import { describe, expect, it } from 'vitest';
import { completedPatterns, requestOf, unmatched, type Filled } from './start';

const filled: Filled = {
  model: 'abc',
  traces: ['t'],
  held_out: ['h'],
  name: ' mine ',
  patterns: 'joint2.*, *.mass',
  effects: ['backlash'],
  other: 'machine',
};

describe('patterns of parameters', () => {
  const names = ['joint2.motor.torque_constant', 'link1.mass'];

  it('that match nothing are named', () => {
    expect(unmatched('joint2.*, *.mass joint2.foo link1.mas', names)).toEqual(['joint2.foo', 'link1.mas']);
    expect(unmatched('link?.mass link[12].*', names)).toEqual([]);
  });

  it('are completed by what the model has', () => {
    expect(completedPatterns('*.mass, joint2', names)).toEqual(['*.mass, joint2.motor.torque_constant']);
    expect(completedPatterns('link1.mass', names)).toEqual([]);
  });
});

describe('what was filled in', () => {
  it('becomes a fit with its effects and patterns', () => {
    expect(requestOf('fit', filled)).toEqual({
      kind: 'fit',
      traces: ['t'],
      held_out: ['h'],
      model: 'abc',
      effects: [{ name: 'backlash' }],
      parameters: ['joint2.*', '*.mass'],
      name: 'mine',
    });
  });

  it('leaves to the service what was left empty', () => {
    const empty = requestOf('fit', { ...filled, name: ' ', patterns: ' ', effects: [] });
    expect(empty).not.toHaveProperty('name');
    expect(empty).not.toHaveProperty('parameters');
  });

  it('becomes a validation without traces held out, or a comparison of different models', () => {
    expect(requestOf('validate', filled)).not.toHaveProperty('held_out');
    expect(requestOf('compare', filled)).toMatchObject({ models: ['machine', 'abc'] });
    expect(requestOf('compare', { ...filled, other: 'abc' })).toMatchObject({ models: ['abc'] });
  });
});
