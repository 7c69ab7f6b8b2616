import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import type { StopResult } from '../api/types';
import { AGAIN_AFTER, ATTEMPTS, isStopKey, StopCall, TELL_AFTER, type StopState } from './stop';

const CONFIRMED: StopResult = {
  delivered: true,
  confirmed: true,
  tick: 7,
  seconds: 0.03,
  note: '',
  detail: 'frozen at tick 7',
  text: 'stopped, confirmed by the board: frozen at tick 7',
};
const never = (): Promise<StopResult> => new Promise(() => {});
const refused = (why: string) => (): Promise<StopResult> => Promise.reject(new Error(why));

let told: StopState[];

function begin(...doors: (() => Promise<StopResult>)[]): StopCall {
  const call = new StopCall({
    doors,
    after: (seconds, then) => {
      const timer = setTimeout(then, seconds * 1000);
      return () => clearTimeout(timer);
    },
    told: (state) => told.push(state),
  });
  call.begin();
  return call;
}

const pass = (seconds: number): Promise<unknown> => vi.advanceTimersByTimeAsync(seconds * 1000);
const last = (): StopState => told.at(-1) as StopState;

beforeEach(() => {
  told = [];
  vi.useFakeTimers();
});
afterEach(() => vi.useRealTimers());

describe('a press of Stop', () => {
  it('sends before anything else happens', () => {
    const send = vi.fn(never);
    begin(send);
    expect(send).toHaveBeenCalledTimes(1);
    expect(last()).toEqual({ kind: 'sending' });
  });

  it('tells that the board has confirmed it, and sends nothing more', async () => {
    const send = vi.fn(() => Promise.resolve(CONFIRMED));
    begin(send);
    await pass(10);
    expect(last()).toEqual({ kind: 'confirmed', text: 'frozen at tick 7', seconds: 0.03 });
    expect(send).toHaveBeenCalledTimes(1);
  });

  it.each([
    [{ ...CONFIRMED, confirmed: false }, 'delivered'],
    [{ ...CONFIRMED, confirmed: false, delivered: false }, 'not delivered'],
  ])('never calls %o confirmed', async (result, kind) => {
    begin(() => Promise.resolve(result));
    await pass(0);
    expect(last().kind).toBe(kind);
  });

  it('goes through the next door while the first does not answer', async () => {
    const listener = vi.fn(() => Promise.resolve(CONFIRMED));
    begin(never, listener);
    expect(listener).not.toHaveBeenCalled();
    await pass(AGAIN_AFTER);
    expect(last().kind).toBe('confirmed');
  });

  it('says NOT DELIVERED within a second when nothing answers, and to use the emergency stop', async () => {
    begin(never, never);
    await pass(TELL_AFTER);
    expect(TELL_AFTER).toBeLessThan(1);
    expect(last()).toMatchObject({
      kind: 'not delivered',
      text: expect.stringContaining('emergency stop') as string,
    });
  });

  it('says so at once when every door is closed, and tries on', async () => {
    begin(refused('no network'), refused('no network'));
    await pass(AGAIN_AFTER);
    expect(last()).toMatchObject({
      kind: 'not delivered',
      text: expect.stringContaining('No network.') as string,
    });
    expect(last()).toMatchObject({ text: expect.stringContaining('sent again') as string });
  });

  it('says in words of its own that nobody answers', async () => {
    begin(() => Promise.reject(new TypeError('Failed to fetch')));
    await pass(0);
    expect((last() as { text: string }).text).toMatch(
      /^The service does not answer\. Use the emergency stop\./,
    );
  });

  it('is confirmed by an answer that comes late', async () => {
    let answer: (result: StopResult) => void = () => {};
    begin(() => new Promise((resolve) => (answer = resolve)));
    await pass(TELL_AFTER);
    answer(CONFIRMED);
    await pass(0);
    expect(last().kind).toBe('confirmed');
  });

  it('ends: nothing is sent for ever', async () => {
    const send = vi.fn(never);
    begin(send);
    await pass(60);
    expect(send).toHaveBeenCalledTimes(ATTEMPTS);
  });

  it('does not say that it is sent again when it no longer is, and stays undelivered', async () => {
    begin(never);
    await pass((ATTEMPTS - 1) * AGAIN_AFTER - 0.01);
    expect(last()).toMatchObject({ text: expect.stringContaining('It is being sent again.') as string });
    await pass(0.01);
    const text = (last() as { text: string }).text;
    expect(last().kind).toBe('not delivered');
    expect(text).toContain(
      'Use the emergency stop. Nothing is being sent now, and an earlier one may still arrive.',
    );
    expect(text).not.toContain('sent again.');
    await pass(60);
    expect(last()).toEqual({ kind: 'not delivered', text });
  });

  it('says that none may arrive any more when all were refused', async () => {
    begin(refused('the service does not answer'));
    await pass(60);
    expect(last()).toMatchObject({
      text: expect.stringContaining('Nothing is being sent now. Press') as string,
    });
  });

  it('tells and sends nothing once another press has taken over', async () => {
    const send = vi.fn(never);
    begin(send).leave();
    const before = told.length;
    await pass(60);
    expect(told).toHaveLength(before);
    expect(send).toHaveBeenCalledTimes(1);
  });
});

it.each([
  [{ key: 'F8' }, true],
  [{ key: 'Pause' }, true],
  [{ key: 'F8', altKey: true }, false],
  [{ key: 's' }, false],
])('the key %o stops: %s', (key, stops) => {
  expect(isStopKey({ altKey: false, metaKey: false, ...key })).toBe(stops);
});
