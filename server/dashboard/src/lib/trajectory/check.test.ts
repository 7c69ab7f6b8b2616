import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { notAnswered, Problem } from '../api/problem';
import { hindranceOf, MotionCheck, QUIET, toldOf, type Check, type Standing } from './check';

interface Motion {
  of: string;
  violations: readonly string[];
}
interface Request {
  spec: string;
  answer(violations?: readonly string[]): void;
  fail(problem: Problem): void;
}

let requests: Request[];
let told: Check<Motion>[];
let check: MotionCheck<string, Motion>;

const pass = (seconds: number): Promise<unknown> => vi.advanceTimersByTimeAsync(seconds * 1000);
const last = (): Check<Motion> => told.at(-1) as Check<Motion>;

beforeEach(() => {
  vi.useFakeTimers();
  requests = [];
  told = [];
  check = new MotionCheck<string, Motion>({
    ask: (spec) =>
      new Promise((resolve, reject) => {
        const answer = (violations: readonly string[] = []): void => resolve({ of: spec, violations });
        requests.push({ spec, answer, fail: reject });
      }),
    after: (seconds, call) => {
      const timer = setTimeout(call, seconds * 1000);
      return () => clearTimeout(timer);
    },
    told: (found) => told.push(found),
  });
});
afterEach(() => vi.useRealTimers());

describe('the check of a motion', () => {
  it('asks when typing has paused, for the last of what was typed', async () => {
    check.changed('1');
    await pass(QUIET / 2);
    check.changed('15');
    expect(last()).toEqual({ state: 'checking' });
    await pass(QUIET);
    expect(requests.map((one) => one.spec)).toEqual(['15']);
    requests[0]!.answer();
    await pass(0);
    expect(last()).toEqual({ state: 'checked', motion: { of: '15', violations: [] } });
  });

  it('does not take an answer to what is no longer in the fields, which cannot be read now', async () => {
    check.changed('40');
    await pass(QUIET);
    check.changed(null);
    requests[0]!.answer();
    await pass(1);
    expect(last()).toEqual({ state: 'unreadable' });
    expect(told.map((one) => one.state)).not.toContain('checked');
  });

  it('does not take an answer to the motion before for the one that was typed shortly before it came', async () => {
    check.changed('40');
    await pass(QUIET);
    check.changed('200');
    requests[0]!.answer();
    await pass(0);
    expect(last()).toEqual({ state: 'checking' });
    await pass(QUIET);
    requests[1]!.answer(['joint 2: 240°']);
    await pass(0);
    expect(last()).toEqual({ state: 'checked', motion: { of: '200', violations: ['joint 2: 240°'] } });
  });

  it('does not take a late answer after a newer one', async () => {
    check.changed('200');
    await pass(QUIET);
    check.changed('5');
    await pass(QUIET);
    requests[1]!.answer();
    requests[0]!.answer(['joint 2: 240°']);
    await pass(0);
    expect(last()).toMatchObject({ state: 'checked', motion: { of: '5' } });
  });

  it('tells why there is no answer, and nothing of a failure that came too late', async () => {
    check.changed('5');
    await pass(QUIET);
    requests[0]!.fail(notAnswered());
    await pass(0);
    expect(last()).toMatchObject({ state: 'failed', problem: { status: 0 } });
    check.changed('6');
    await pass(QUIET);
    check.changed('7');
    requests[1]!.fail(notAnswered());
    await pass(0);
    expect(last()).toEqual({ state: 'checking' });
  });

  it('tells and asks nothing more once it is left', async () => {
    check.changed('5');
    check.leave();
    await pass(1);
    expect(requests).toEqual([]);
    check.changed('6');
    await pass(QUIET);
    check.leave();
    requests[0]!.answer();
    await pass(0);
    expect(told.map((one) => one.state)).toEqual(['checking', 'checking']);
  });
});

describe('what is said of a check', () => {
  const standing = (more: Partial<Standing>): Standing => ({
    check: { state: 'checked', motion: { violations: [] } },
    wrong: {},
    isConnected: true,
    ...more,
  });
  const words = (more: Partial<Standing>): [string, string] => [
    toldOf(standing(more)).text,
    hindranceOf(standing(more)),
  ];
  const broken: Standing['check'] = { state: 'checked', motion: { violations: ['one', 'two'] } };

  it('is good for a checked motion alone', () => {
    expect(words({})).toEqual(['motion within its limits', '']);
    expect(words({ check: { state: 'checking' } })).toEqual(['checking', 'the motion is being checked']);
    expect(words({ check: broken })).toEqual([
      '2 limits broken',
      'this motion would break a limit: see the preview',
    ]);
    for (const check of [
      broken,
      { state: 'checking' },
      { state: 'unreadable' },
      { state: 'failed', problem: notAnswered() },
    ] as const) {
      expect(toldOf(standing({ check })).tone).not.toBe('good');
      expect(hindranceOf(standing({ check }))).not.toBe('');
    }
  });

  it('is neither “checking” nor of an old motion while a field needs another value', () => {
    const wrong = { name: 'letters and digits' };
    const one = ['not checked: Name needs another value', 'Name: letters and digits'];
    expect(words({ wrong, check: { state: 'unreadable' } })).toEqual(one);
    expect(words({ wrong, check: broken })).toEqual(one);
    const several = { 'trajectory.amplitude.2': '“x” is not a number', settle: 'too long', count: 'from 1' };
    expect(words({ wrong: several, check: { state: 'checking' } })).toEqual([
      'not checked: Amplitude needs another value; 2 more',
      'Amplitude: “x” is not a number; 2 more',
    ]);
    expect(words({ wrong: { settle: 'too long' } })[1]).toBe('Hold before: too long');
  });

  it('is not good without a connection, whatever was found before', () => {
    expect(words({ isConnected: false })).toEqual([
      'not checked: no connection',
      'the service cannot be reached: nothing can be sent',
    ]);
  });

  it('says why the service could not check it', () => {
    const problem = new Problem(409, 'no-rest', 'the rest posture is not known');
    expect(words({ check: { state: 'failed', problem } })).toEqual([
      'not checked',
      'the motion is not checked: the rest posture is not known',
    ]);
  });
});
