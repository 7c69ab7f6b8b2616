import { describe, expect, it } from 'vitest';
import { namesFor, requestOf, unknownIn, type Filled } from './start';

const filled: Filled = {
  model: 'abc',
  traces: ['t'],
  held_out: ['h'],
  name: ' mine ',
  patterns: 'joint2.*, *.mass',
  effects: ['backlash'],
  other: 'machine',
};

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

describe('names of parameters', () => {
  const names = ['joint2.friction', 'joint2.stiffness', 'link1.mass'];

  it('are refused before anything waits for them, with those that there are', () => {
    expect(unknownIn('joint2.*, *.mass', names)).toBe('');
    expect(unknownIn('joint2.foo', names)).toBe(
      'no parameter is joint2.foo; there are joint2.friction, joint2.stiffness',
    );
    expect(unknownIn('foo', names)).toBe('no parameter is foo');
  });

  it('are completed behind those that stand there', () => {
    expect(namesFor('*.mass, joint2.s', names)).toEqual(['*.mass, joint2.stiffness']);
  });
});
