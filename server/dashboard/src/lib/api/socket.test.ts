import { beforeEach, describe, expect, it } from 'vitest';
import {
  ANSWER_WITHIN,
  backOff,
  isMissing,
  LiveSocket,
  OPEN_WITHIN,
  SILENT_AFTER,
  type Socket,
  type SocketState,
} from './socket';
import type { LiveFrame } from './types';

/** Time that is moved by hand, with everything that waits for it. */
class HandClock {
  now = 0;
  private waiting: { at: number; call: () => void }[] = [];

  after(seconds: number, call: () => void): () => void {
    const one = { at: this.now + seconds, call };
    this.waiting.push(one);
    return () => {
      this.waiting = this.waiting.filter((other) => other !== one);
    };
  }

  async pass(seconds: number): Promise<void> {
    const end = this.now + seconds;
    for (;;) {
      await settle();
      const next = this.waiting
        .filter((one) => one.at <= end + 1e-9)
        .sort((one, other) => one.at - other.at)[0];
      if (next === undefined) break;
      this.waiting = this.waiting.filter((one) => one !== next);
      this.now = Math.max(this.now, next.at);
      next.call();
    }
    this.now = end;
    await settle();
  }
}

const settle = async (): Promise<void> => {
  for (let turn = 0; turn < 5; turn += 1) await Promise.resolve();
};

class FakeSocket implements Socket {
  onopen: Socket['onopen'] = null;
  onclose: Socket['onclose'] = null;
  onmessage: Socket['onmessage'] = null;
  sent: string[] = [];
  closed = false;

  listen(): void {}
  send(text: string): void {
    this.sent.push(text);
  }
  close(): void {
    this.closed = true;
  }
  opens(): void {
    this.onopen?.({} as Event);
  }
  says(frame: Partial<LiveFrame>): void {
    this.onmessage?.({ data: JSON.stringify(frame) } as MessageEvent<string>);
  }
  breaks(reason = ''): void {
    this.onclose?.({ reason } as CloseEvent);
  }
}

let clock: HandClock;
let sockets: FakeSocket[];
let states: SocketState[];
let frames: LiveFrame[];
let refusal: Error | null;
let live: LiveSocket;

beforeEach(async () => {
  clock = new HandClock();
  [sockets, states, frames, refusal] = [[], [], [], null];
  live = new LiveSocket({
    open: async () => {
      if (refusal !== null) throw refusal;
      sockets.push(new FakeSocket());
      return newest();
    },
    frame: (frame) => frames.push(frame),
    state: (state) => states.push(state),
    now: () => clock.now,
    after: (seconds, call) => clock.after(seconds, call),
  });
  live.start();
  await settle();
});

const newest = (): FakeSocket => sockets.at(-1) as FakeSocket;
const phase = (): string => states.at(-1)?.phase ?? '';

describe('the live socket', () => {
  it('opens', () => {
    newest().opens();
    expect(phase()).toBe('open');
  });

  it('hands frames on', () => {
    newest().opens();
    newest().says({ now: 5, messages: [] });
    expect(frames).toEqual([{ now: 5, messages: [] }]);
  });

  it('comes back by itself', async () => {
    newest().opens();
    newest().breaks('the service ends');
    expect(states.at(-1)).toMatchObject({ phase: 'lost', why: 'the service ends' });
    await clock.pass(backOff(1));
    expect(sockets).toHaveLength(2);
    expect(states).toContainEqual({ phase: 'open', again: false });
    newest().opens();
    expect(states.at(-1)).toEqual({ phase: 'open', again: true });
  });

  it('waits longer from attempt to attempt, up to a limit, and begins anew after a success', async () => {
    refusal = new Error('the service does not answer');
    newest().breaks();
    const waits: number[] = [];
    for (let attempt = 0; attempt < 7; attempt += 1) {
      const state = states.at(-1);
      if (state?.phase !== 'lost') throw new Error(`not lost but ${phase()}`);
      waits.push(state.retryAt - clock.now);
      await clock.pass(state.retryAt - clock.now);
    }
    expect(waits.map((wait) => Math.round(wait * 100) / 100)).toEqual([0.25, 0.5, 1, 2, 3, 3, 3]);
    refusal = null;
    await clock.pass(3);
    newest().opens();
    newest().breaks();
    expect(states.at(-1)).toMatchObject({ phase: 'lost', retryAt: clock.now + 0.25 });
  });

  it('gives up an attempt that opens nothing', async () => {
    await clock.pass(OPEN_WITHIN);
    expect(sockets[0]?.closed).toBe(true);
    expect(states.some((state) => state.phase === 'lost')).toBe(true);
  });

  it('notices a connection that is dead without being closed', async () => {
    newest().opens();
    await clock.pass(SILENT_AFTER);
    expect(JSON.parse(newest().sent.at(-1) ?? '')).toEqual({ history: 0, points: 10 });
    expect(phase()).toBe('open');
    await clock.pass(ANSWER_WITHIN);
    expect(sockets[0]?.closed).toBe(true);
    expect(
      states.some((state) => state.phase === 'lost' && state.why === 'the service has gone silent'),
    ).toBe(true);
  });

  it('stays with a silent service that answers when asked', async () => {
    newest().opens();
    for (let second = 0; second < 5; second += 1) {
      await clock.pass(SILENT_AFTER);
      newest().says({ now: clock.now, messages: [] });
    }
    expect(sockets).toHaveLength(1);
    expect(phase()).toBe('open');
  });

  it('tries at once when it is told to', async () => {
    newest().opens();
    newest().breaks();
    live.retryNow();
    await settle();
    expect(sockets).toHaveLength(2);
  });

  it('listens to nothing of an earlier connection', async () => {
    const first = newest();
    first.opens();
    const late = first.onmessage;
    first.breaks();
    await clock.pass(1);
    newest().opens();
    late?.({ data: JSON.stringify({ now: 1, messages: [] }) } as MessageEvent<string>);
    expect(frames).toEqual([]);
  });

  it('says so when it cannot send', () => {
    expect(live.send({ history: 1 })).toBe(false);
    newest().opens();
    expect(live.send({ history: 1 })).toBe(true);
  });

  it('does not come back once it has been ended', async () => {
    newest().opens();
    live.end();
    await clock.pass(60);
    expect(sockets).toHaveLength(1);
    expect(sockets[0]?.closed).toBe(true);
  });
});

describe('a connection that is missing', () => {
  it('is told without a break until it is back', () => {
    expect(isMissing({ phase: 'lost', attempt: 0, why: '', retryAt: 1 }, true)).toBe(true);
    expect(isMissing({ phase: 'connecting', attempt: 1 }, true)).toBe(true);
    expect(isMissing({ phase: 'connecting', attempt: 2 }, true)).toBe(true);
    expect(isMissing({ phase: 'open', again: true }, true)).toBe(false);
  });

  it('has a moment when the page is opened', () => {
    expect(isMissing({ phase: 'connecting', attempt: 1 }, false)).toBe(false);
    expect(isMissing({ phase: 'connecting', attempt: 2 }, false)).toBe(true);
  });
});
