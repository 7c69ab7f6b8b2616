import { expect, it } from 'vitest';
import { Comparison } from './comparison.svelte';
import { ShownTrace } from './shown_trace.svelte';

it('draws a difference while there are two traces, and keeps the spectrum of one', () => {
  const comparison = new Comparison();
  const two = [new ShownTrace('a'), new ShownTrace('b')];
  comparison.chosenBeside = ['difference', 'spectrum'];
  comparison.traces = two;
  expect(comparison.beside).toEqual(['difference', 'spectrum']);
  comparison.traces = two.slice(0, 1);
  expect(comparison.beside).toEqual(['spectrum']);
});
