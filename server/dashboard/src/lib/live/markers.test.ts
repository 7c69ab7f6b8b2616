import { expect, it } from 'vitest';
import type { RecordEventMessage } from '../api/types';
import { explanationsOf, markLabel, marksOf } from './markers';

const event = (kind: RecordEventMessage['kind'], host_time: number, message = ''): RecordEventMessage => ({
  topic: 'record_event',
  kind,
  message,
  tick: null,
  joint: null,
  host_time,
  time: host_time,
  experiment: null,
});

it('marks what matters with a name, what comes often with a tick, and nothing outside the window', () => {
  const marks = marksOf(
    [
      event('ramp_start', 1, 'ramp starts'),
      event('waypoint', 1, 'via point 1 of 2'),
      event('limit', 2),
      event('retry', 3),
      event('stop', 9),
    ],
    0,
    5,
  );
  expect(marks).toEqual([
    { x: 1, label: 'ramp starts', tone: 'plain' },
    { x: 2, label: '▲ limit', tone: 'warn' },
    { x: 3, label: '', tone: 'tick' },
  ]);
});

it('calls a motion by its own name', () => {
  expect(markLabel(event('ramp_start', 1, 'sine starts'))).toBe('sine starts');
  expect(markLabel(event('ramp_end', 1, 'sine ends'))).toBe('sine ends');
});

it('explains what is unusual, with how often it came and what was said last', () => {
  const events = [
    event('start', 0, 'record starts'),
    event('pause', 1, 'joint 1: positional error of 140 ADC counts'),
    event('pause', 2, 'joint 2: positional error of 150 ADC counts'),
    event('retry', 3, '2 requests had to be repeated'),
    event('fault', 9, 'outside'),
  ];
  expect(explanationsOf(events, 0, 5)).toEqual([
    { label: '▲ set points wait', count: 2, text: 'joint 2: positional error of 150 ADC counts' },
    { label: '◆ repeated requests', count: 1, text: '2 requests had to be repeated' },
  ]);
});
