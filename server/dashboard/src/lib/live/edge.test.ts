import { expect, it } from 'vitest';
import { timeOfDay } from '../format';
import { edgeText } from './edge';

const WALL = Date.parse('2024-05-06T12:00:30Z');

it('is called now only while it is', () => {
  expect(edgeText(true, 0.02, WALL)).toBe('now');
  expect(edgeText(false, 25, WALL)).toBe(timeOfDay('2024-05-06T12:00:05Z'));
  expect(edgeText(false, null, WALL)).toBe('last sample');
});
