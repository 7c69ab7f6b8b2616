import { describe, expect, it } from 'vitest';
import { asProblem, NOT_ANSWERED, notAnswered, Problem, problemOf } from './problem';

describe('what was thrown, as a problem', () => {
  it.each(['Failed to fetch', 'NetworkError when attempting to fetch resource.', 'Load failed'])(
    'a request that nobody answers: %s',
    (message) => {
      const problem = asProblem(new TypeError(message));
      expect(problem).toMatchObject({ status: 0, kind: NOT_ANSWERED, detail: 'the service does not answer' });
      expect(problem.advice).not.toContain('load the page');
    },
  );

  it('told in its own words has no advice that does not help', () => {
    expect(asProblem(new Error('the worker has run out of memory'))).toMatchObject({
      detail: 'the worker has run out of memory',
      advice: '',
    });
  });

  it('a fault of the page itself may be gone when it is loaded again', () => {
    const gone = 'Failed to fetch dynamically imported module: /assets/Traces.js';
    expect(asProblem(new TypeError(gone))).toMatchObject({ detail: gone, advice: 'load the page again' });
    expect(asProblem('nothing')).toMatchObject({ detail: 'nothing', advice: 'load the page again' });
  });

  it('that is a problem already stays it', () => {
    const problem = notAnswered();
    expect(asProblem(problem)).toBe(problem);
  });
});

describe('the answer of the service, as a problem', () => {
  it('has its kind, its words and the fields that are wrong', () => {
    const body = {
      type: 'https://example.org/problems#stopped',
      detail: 'the arm is stopped',
      advice: 'reset it',
      fields: [{ field: 'start', message: 'too far' }],
    };
    expect(problemOf(409, body)).toMatchObject({
      status: 409,
      kind: 'stopped',
      detail: 'the arm is stopped',
    });
    expect(problemOf(409, body).fields).toEqual(body.fields);
  });

  it.each([null, 'Bad Gateway', {}])('without words of its own: %o', (body) => {
    const problem = problemOf(502, body);
    expect(problem).toBeInstanceOf(Problem);
    expect(problem).toMatchObject({ kind: 'http', detail: 'the service answered 502', fields: [] });
  });
});
