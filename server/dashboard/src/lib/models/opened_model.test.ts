import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import type { ModelDetails, ModelParameter } from '../api/types';
import { OpenedModel, type ModelRequests } from './opened_model.svelte';

const parameter = {
  name: 'joint2.motor.resistance',
  words: { joint: 2, group: 'joint 2', short: 'motor resistance', label: 'J2 motor resistance' },
  unit: 'Ω',
  value: 5,
  deviation: 0.5,
} as ModelParameter;
const details = (job: string | null): ModelDetails =>
  ({
    entry: { id: 'a', name: 'first fit', job },
    parameters: [parameter],
    effects: [],
    ancestors: [],
  }) as never;
const found = {
  name: parameter.name,
  low: 4.8,
  high: 5.2,
  verdict: 'known',
  reason: '',
  expected: 5,
  expected_deviation: 1,
};

/** A service that answers so; what is not given is not asked for. */
function service(answers: Partial<ModelRequests>): ModelRequests {
  const unasked = (): never => {
    throw new Error('not to be asked');
  };
  return { ofMachine: unasked, model: unasked, result: unasked, remove: unasked, save: unasked, ...answers };
}

describe('a model that is looked at', () => {
  it('of the machine file has parameters, and no maker', async () => {
    const opened = new OpenedModel('machine', service({ ofMachine: () => Promise.resolve([parameter]) }));
    await opened.load();
    expect(opened.details).toBeNull();
    expect(opened.rows.map((row) => [row.short, row.known])).toEqual([['motor resistance', 'given']]);
  });

  it('has the intervals of the fit that made it', async () => {
    const asked: string[] = [];
    const opened = new OpenedModel(
      'a',
      service({
        model: () => Promise.resolve(details('f')),
        result: (job) => {
          asked.push(job);
          return Promise.resolve({ kind: 'fit', data: { parameters: [found] } });
        },
      }),
    );
    await opened.load();
    expect(asked).toEqual(['f']);
    expect(opened.rows[0]).toMatchObject({ low: 4.8, high: 5.2, known: 'known' });
    expect(opened.fit).not.toBeNull();
  });

  it('is shown without them where that job was taken away, and says so where the service fails', async () => {
    const refuse = (status: number) =>
      new OpenedModel(
        'a',
        service({
          model: () => Promise.resolve(details('f')),
          result: () => Promise.reject(new Problem(status, 'kind', 'the reason')),
        }),
      );
    const [gone, failed] = [refuse(404), refuse(500)];
    await gone.load();
    await failed.load();
    expect([gone.problem, gone.rows[0]?.known]).toEqual([null, 'given']);
    expect([failed.problem?.detail, failed.rows.length]).toEqual(['the reason', 1]);
  });

  it('keeps what a validation found, and nothing else', async () => {
    const results = [
      { kind: 'validate', data: { fidelity: 1 } },
      { kind: 'compare', data: { models: 1 } },
    ];
    const opened = new OpenedModel('a', service({ result: () => Promise.resolve(results.shift()!) }));
    await opened.loadValidation('v');
    await opened.loadValidation('c');
    expect(opened.validation).toEqual({ fidelity: 1 });
  });

  it('that could not be loaded still says so when its validation comes', async () => {
    const opened = new OpenedModel(
      'a',
      service({
        model: () => Promise.reject(new Problem(500, 'fault', 'the reason')),
        result: () => Promise.resolve({ kind: 'validate', data: {} }),
      }),
    );
    await Promise.all([opened.load(), opened.loadValidation('v')]);
    expect(opened.problem?.detail).toBe('the reason');
  });

  it('says whether it could be taken away, and why not', async () => {
    const answers = [Promise.reject(new Problem(409, 'in-use', 'a job needs it')), Promise.resolve()];
    const opened = new OpenedModel('a', service({ remove: () => answers.shift()! }));
    expect(await opened.remove()).toBe(false);
    expect(opened.problem?.detail).toBe('a job needs it');
    expect(await opened.remove()).toBe(true);
    expect(opened.problem).toBeNull();
  });
});
