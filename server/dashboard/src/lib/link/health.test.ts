import { describe, expect, it } from 'vitest';
import type { LinkMessage } from '../api/types';
import { LinkHealth, OVER, type Health } from './health';

const told = (counters: Record<string, number>, state: LinkMessage['state'] = 'connected'): LinkMessage => ({
  topic: 'link',
  state,
  counters,
  host_time: 0,
});
const retries = (health: Health) => health.figures.find((figure) => figure.name === 'Retries');

describe('counters of the link', () => {
  it('tell what is going on now from what once was', () => {
    const health = new LinkHealth();
    health.heard(told({ requests: 100, retries: 40 }), 0);
    expect(retries(health.heard(told({ requests: 200, retries: 43 }), 30))).toMatchObject({
      total: 43,
      lately: 3,
    });
    health.heard(told({ requests: 300, retries: 43 }), 120);
    expect(retries(health.heard(told({ requests: 400, retries: 44 }), 121))).toMatchObject({ lately: 1 });
    expect(retries(health.heard(told({ requests: 10, retries: 1 }), 122))).toMatchObject({ lately: 0 }); // a new link
  });

  it('say over how many seconds they are: a minute, or as long as this page hears of the link', () => {
    const health = new LinkHealth();
    const over = [0, 8, 59, 62, 100, 101].map((at) => health.heard(told({ requests: at }), at).over);
    expect(over).toEqual([0, 8, 59, 62, 92, 93]);
  });

  it('have no round trip before the first', () => {
    const health = new LinkHealth();
    expect(health.heard(told({}), 0).roundTrip).toBeNull();
    expect(health.heard(told({ round_trip_p99_s: 0.004 }), 1).roundTrip).toBeCloseTo(4);
  });
});

/** What is said each second at 50 requests a second, of which `wrong` a second go wrong until `until`. */
function follow(wrong: number, until: number, seconds: number): string[] {
  const health = new LinkHealth();
  return Array.from({ length: seconds }, (_, at) => {
    const late = wrong * Math.min(at, until);
    return health.heard(told({ requests: 50 * at, late }, at % 2 ? 'degraded' : 'connected'), at).text;
  });
}

describe('the verdict on the link', () => {
  it('is one over ten seconds: neither one repeat nor a moment in order changes it', () => {
    expect(new Set(follow(0.3, 60, 60))).toEqual(new Set(['healthy']));
    const said = follow(2, 20, 60);
    expect(said.slice(3, 20 + OVER)).toEqual(Array(17 + OVER).fill('degraded'));
    expect(said.slice(20 + 2 * OVER)).toEqual(Array(40 - 2 * OVER).fill('healthy'));
  });

  it('is not made by the moment in which a browser starts', () => {
    expect(new Set(follow(4, 1, 60))).toEqual(new Set(['healthy']));
    const health = new LinkHealth();
    health.heard(told({ requests: 0 }), 0);
    // Each repeat follows a time-out: three replies were lost, not six.
    expect(health.heard(told({ requests: 350, timeouts: 3, retries: 3 }), 7).text).toBe('healthy');
  });

  it('says what is wrong and what to do', () => {
    const health = new LinkHealth();
    health.heard(told({ requests: 0 }), 0);
    expect(health.heard(told({ requests: 500, late: 300 }), 10).why).toBe(
      'Of 500 requests in 10 s: late samples 300. The service’s computer is busy, or the line is slow: end other programs on that computer.',
    );
  });

  it('finds a board whose clock stands still, though no request goes wrong', () => {
    const health = new LinkHealth();
    health.heard(told({ requests: 0 }), 0, { tick: 0, host_time: 0 }, 0.02);
    const slow = health.heard(told({ requests: 400 }), 10, { tick: 390, host_time: 10 }, 0.02);
    expect([slow.text, slow.why]).toEqual(['degraded', expect.stringMatching(/^The board makes 78 %/)]);
  });

  it('is what the service says of one that is lost or not open', () => {
    const health = new LinkHealth();
    expect(health.heard(told({}, 'lost'), 0)).toMatchObject({ tone: 'bad', text: 'lost' });
    expect(health.heard(told({}, 'none'), 1).text).toBe('not open');
  });
});
