import { expect, it } from 'vitest';
import { completionsOf, searchOf, withFilter } from './query';

const known = {
  tags: ['cold', 'cold start'],
  kinds: ['ramp', 'sine'],
  joints: [1, 2],
  effects: ['backlash', 'coulomb_friction'],
};

it('free words are searched for, and filters are told apart from them', () => {
  const { search, problem } = searchOf(
    'dry friction tag:"cold start" source:real outcome:fault kind:ramp joint:2 effect:backlash "a:b" 12:30',
  );
  expect(problem).toBe('');
  expect(search).toEqual({
    q: 'dry friction a:b 12:30',
    tag: 'cold start',
    source: 'real',
    outcome: 'fault',
    kind: 'ramp',
    joint: 2,
    effect: 'backlash',
  });
});

it('days are midnights here', () => {
  const { search } = searchOf('after:2026-11-01 before:2026-12-01');
  expect(search).toEqual({
    since: new Date(2026, 10, 1).toISOString(),
    until: new Date(2026, 11, 1).toISOString(),
  });
});

it.each([
  ['source:moon', 'source: needs one of mock, real, imported'],
  ['after:yesterday', 'after: needs a date such as 2026-11-30'],
  ['after:2026-13-01', 'after: needs a date'],
  ['before:2026-02-31', 'before: needs a date'],
  ['speed:3 x', 'speed: is not a filter; there are joint:2, effect:backlash, tag:cold'],
  ['-tag:cold', 'nothing can be left out'],
  ['effect:nonsense', 'there is no nonsense; type effect: alone'],
  ['effect:coulomb', 'there is no coulomb; there is coulomb_friction'],
  ['speed:', 'speed: is not a filter'],
  ['effect: backlash', 'effect: needs its value next to it'],
  ['joint:two', 'joint: needs a number from 1'],
  ['joint:9', 'there is no joint 9, joints are 1 to 6'],
  ['effect:Backlash', 'effect: needs a name'],
  ['tag:a tag:b', 'tag: can be given once'],
])('%s is refused in one line', (line, problem) => {
  expect(searchOf(line, 6, known.effects).problem).toContain(problem);
});

it('a filter that is being typed filters nothing yet', () => {
  expect(searchOf('cold tag:')).toEqual({ search: { q: 'cold' }, problem: '' });
});

it('the last word is completed: keys first, then what is known', () => {
  expect(completionsOf('x so', known)).toEqual(['x source:']);
  expect(completionsOf('x source:r', known)).toEqual(['x source:real']);
  expect(completionsOf('joint:', known)).toEqual(['joint:1', 'joint:2']);
  expect(completionsOf('x effect:c', known)).toEqual(['x effect:coulomb_friction']);
  expect(completionsOf('tag:c', known)).toEqual(['tag:cold']);
  expect(completionsOf('tag:"', known)).toEqual(['tag:"cold start"']);
  expect(completionsOf('source:real ', known)).not.toContain('source:real source:');
});

it('one filter takes the place of another of its key', () => {
  expect(withFilter('x tag:"a b" y', 'tag', 'c')).toBe('x y tag:c');
  expect(withFilter('', 'tag', 'c d')).toBe('tag:"c d"');
});
