import { expect, it } from 'vitest';
import type { RecordEventMessage } from '../api/types';
import { marksOf } from './markers';

const event = (kind: RecordEventMessage['kind'], host_time: number): RecordEventMessage => ({
  topic: 'record_event',
  kind,
  message: '',
  tick: null,
  joint: null,
  host_time,
  time: host_time,
  experiment: null,
});

it('marks what matters with a name, what comes often with a tick, and nothing outside the window', () => {
  const marks = marksOf(
    [event('ramp_start', 1), event('limit', 2), event('retry', 3), event('stop', 9)],
    0,
    5,
  );
  expect(marks).toEqual([
    { x: 1, label: 'ramp', tone: 'plain' },
    { x: 2, label: '▲ limit', tone: 'warn' },
    { x: 3, label: '', tone: 'tick' },
  ]);
});
