import { describe, expect, it } from 'vitest';
import type { HistoryMessage, SampleMessage } from '../api/types';
import { Recording, SIGNALS } from './recording';
import { MOST_ROWS, shownPart } from './window';

const PERIOD = 0.02;

function sample(tick: number, position = tick, joints = [1, 2]): SampleMessage {
  const row = joints.map((joint) => position + joint / 10);
  return {
    topic: 'sample',
    tick,
    host_time: tick * PERIOD,
    joints,
    set_point: row,
    position: row,
    error: row.map(() => 0),
    drive: row.map(() => 1),
    frozen: false,
    lateness: 0,
  };
}

function history(ticks: number[]): HistoryMessage {
  const row = ticks.map((tick) => tick + 0.5);
  return {
    topic: 'history',
    joints: [1, 2],
    tick: ticks,
    host_time: ticks.map((tick) => tick * PERIOD),
    set_point: [row, row],
    position: [row, row],
    error: [row, row],
    drive: [row, row],
    events: [],
  };
}

const recordingOf = (...ticks: number[]): Recording => {
  const made = new Recording([1, 2], PERIOD, 60);
  for (const tick of ticks) made.addSample(sample(tick));
  return made;
};

describe('the recording', () => {
  it('keeps one column a joint of every signal', () => {
    const made = recordingOf(1, 2);
    expect(made.time).toEqual([0.02, 0.04]);
    expect(made.columns.position).toEqual([
      [1.1, 2.1],
      [1.2, 2.2],
    ]);
  });

  it('has nothing where a joint is not in the sample', () => {
    const made = recordingOf();
    made.addSample(sample(1, 1, [2]));
    expect(made.columns.position).toEqual([[null], [1.2]]);
  });

  it('leaves out what is not newer', () => {
    const made = recordingOf(5, 6);
    made.addSample(sample(6));
    made.addSample(sample(4));
    expect(made.time).toHaveLength(2);
  });

  it('draws no line across a gap, and one across a few missing samples', () => {
    expect(recordingOf(1, 4).columns.position[0]).toEqual([1.1, 4.1]);
    expect(recordingOf(1, 40).columns.position[0]).toEqual([1.1, null, 40.1]);
  });

  it('puts history before what is there already, and nothing twice', () => {
    const made = recordingOf(10, 11);
    made.addHistory(history([8, 9, 10, 11]));
    expect(made.time.map((time) => Math.round(time / PERIOD))).toEqual([8, 9, 10, 11]);
    expect(made.columns.position[0]).toEqual([8.5, 9.5, 10.1, 11.1]);
  });

  it('fills what was missed while there was no connection', () => {
    const made = recordingOf(1, 2);
    made.addHistory(history([1, 2, 3, 4]));
    made.addSample(sample(5));
    expect(made.columns.position[0]).toEqual([1.1, 2.1, 3.5, 4.5, 5.1]);
  });

  it('fills what was missed also when a new sample was there before the past', () => {
    const made = recordingOf(1, 2, 20);
    made.addHistory(history([2, 3, 8, 14, 19, 20]));
    made.addSample(sample(21));
    expect(made.time.map((time) => Math.round(time / PERIOD))).toEqual([1, 2, 3, 8, 14, 19, 20, 21]);
    expect(made.columns.position[0]).toEqual([1.1, 2.1, 3.5, 8.5, 14.5, 19.5, 20.1, 21.1]);
    for (const signal of SIGNALS)
      for (const column of made.columns[signal]) expect(column).toHaveLength(made.time.length);
  });

  it('leaves as much of a gap as the past does not have', () => {
    const made = recordingOf(1, 40, 41, 90);
    made.addHistory(history([10, 12, 41]));
    expect(made.columns.position[0]).toEqual([1.1, null, 10.5, 12.5, null, 40.1, 41.1, null, 90.1]);
    expect(made.time).toEqual([...made.time].sort((one, other) => one - other));
  });

  it('takes a sample for the same whose time is rounded otherwise', () => {
    const made = recordingOf(1, 2);
    const past = history([1, 2, 3]);
    made.addHistory({ ...past, host_time: past.host_time.map((time) => time + 0.0004) });
    expect(made.columns.position[0]).toEqual([1.1, 2.1, 3.5]);
  });

  it('forgets what is older than it keeps, but not at every sample', () => {
    const made = new Recording([1], PERIOD, 1);
    for (let tick = 0; tick < 500; tick += 1) made.addSample(sample(tick, tick, [1]));
    expect(made.time.length).toBeGreaterThanOrEqual(50);
    expect(made.time.length).toBeLessThan(80);
    expect(made.columns.drive[0]).toHaveLength(made.time.length);
  });

  it('keeps an event once, however often it is told', () => {
    const made = recordingOf(1);
    const event = {
      topic: 'record_event',
      kind: 'limit',
      message: 'joint 2',
      tick: 1,
      joint: 2,
      host_time: 1,
      time: 1,
      experiment: null,
    } as const;
    made.addEvent(event);
    made.addEvent({ ...event, host_time: 1.01 });
    expect(made.events).toHaveLength(1);
  });
});

describe('the part that a chart shows', () => {
  it('is what lies in its time, in the unit that is asked for', () => {
    const part = shownPart(recordingOf(1, 2, 3, 4, 5), [['position', 0, 10]], 0.045, 0.075);
    expect(part.time.map((time) => Math.round(time / PERIOD))).toEqual([2, 3, 4]);
    expect(part.columns[0]?.map((value) => Math.round(value ?? 0))).toEqual([21, 31, 41]);
  });

  it('does not change what is recorded', () => {
    const made = recordingOf(1, 2);
    shownPart(made, [['position', 0, 57]], 0, 1);
    expect(made.columns.position[0]).toEqual([1.1, 2.1]);
  });

  it('loses no peak when it is thinned', () => {
    const made = new Recording([1], PERIOD, 400);
    const count = 4 * MOST_ROWS;
    for (let tick = 0; tick < count; tick += 1)
      made.addSample(sample(tick, tick === 1001 ? 99 : tick === 3003 ? -99 : 0, [1]));
    const part = shownPart(made, [['position', 0, 1]], 0, count * PERIOD);
    expect(part.time.length).toBeLessThanOrEqual(MOST_ROWS + 4);
    const values = part.columns[0]?.map((value) => value ?? 0) ?? [];
    expect(Math.max(...values)).toBeCloseTo(99.1);
    expect(Math.min(...values)).toBeCloseTo(-98.9);
    expect(part.time).toEqual([...part.time].sort((one, other) => one - other));
  });
});
