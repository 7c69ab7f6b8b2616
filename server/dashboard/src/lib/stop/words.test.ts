import { describe, expect, it } from 'vitest';
import { sentence } from '../format';
import { wordsOf } from './words';

const confirmed = { kind: 'confirmed', text: 'its set points are frozen', seconds: 0.03 } as const;
const lost = { kind: 'not delivered', text: 'nobody answers' } as const;

describe('the message about a stop', () => {
  it('is confirmed only while it holds', () => {
    expect(wordsOf(confirmed, 'holds', 'stopped', '12:00:00')).toMatchObject({
      look: 'confirmed',
      head: 'Stopped at 12:00:00, confirmed by the board after 30 ms',
      text: 'Its set points are frozen.',
    });
    expect(wordsOf(confirmed, 'unknown', 'unknown', '12:00:00')).toMatchObject({
      look: 'delivered',
      head: 'Stopped at 12:00:00, confirmed by the board then',
    });
    expect(wordsOf(confirmed, 'past', 'free', '12:00:00')).toMatchObject({
      look: 'past',
      head: 'Past: stopped at 12:00:00, confirmed by the board',
    });
  });

  it('is urgent until what was not delivered is past, and says then how the arm is', () => {
    expect(wordsOf(lost, 'unknown', 'unknown', '')).toMatchObject({
      look: 'not-delivered',
      text: 'Nobody answers.',
    });
    expect(wordsOf(lost, 'answered', 'unknown', '')?.look).toBe('not-delivered');
    expect(wordsOf(lost, 'past', 'free', '12:00:00')).toMatchObject({
      look: 'past',
      head: 'Past: the stop of 12:00:00 was NOT DELIVERED',
      text: 'The arm is not stopped now. Press Stop to stop it.',
    });
    expect(wordsOf(lost, 'past', 'stopped', '')?.text).toBe('The arm is stopped now.');
  });

  it('is none where nothing was stopped', () => {
    expect(wordsOf({ kind: 'none' }, 'past', 'free', '')).toBeNull();
  });
});

it('ends sentences', () => {
  expect(sentence('is it on?')).toBe('Is it on?');
});
