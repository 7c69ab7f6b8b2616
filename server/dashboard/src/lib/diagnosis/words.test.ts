import { describe, expect, it } from 'vitest';
import { sentence } from './words';

describe('sentences of the service', () => {
  it('are told without the words of information theory', () => {
    expect(sentence('a multisine: would tell 28 nats more of the arm’s parameters than another')).toBe(
      'A multisine: would tell more (information gain 28) of the arm’s parameters than another.',
    );
  });

  it('count what there is', () => {
    expect(sentence('tolerance parameters: 1 trace(s), priors')).toBe(
      'Tolerance parameters: 1 trace, priors.',
    );
    expect(sentence('11 trace(s), priors')).toBe('11 traces, priors.');
  });
});
