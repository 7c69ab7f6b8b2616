import { beforeEach, describe, expect, it, vi } from 'vitest';
import type { Job } from '../../lib/api/types';
import { Simulating, type SimulatingRequests } from './simulating.svelte';

const job = (state: Job['state'], reason = ''): Job => ({ id: 'a', state, reason, progress_text: '' }) as Job;
const COMPARED = {
  signals: [{ joints: [1], time: [0, 1], measured: [[0, 0]], simulated: [[[3, 3]]] }],
};

let requests: { [name in keyof SimulatingRequests]: ReturnType<typeof vi.fn<SimulatingRequests[name]>> };
let simulating: Simulating;

beforeEach(() => {
  requests = {
    begin: vi.fn(() => Promise.resolve(job('queued'))),
    news: vi.fn(() => Promise.resolve(job('done'))),
    result: vi.fn(() => Promise.resolve(COMPARED)),
    remove: vi.fn(() => Promise.resolve()),
  };
  simulating = new Simulating('trace', requests);
});

describe('a simulation', () => {
  it('is waited for, and its job is not kept', async () => {
    requests.news.mockResolvedValueOnce(job('running'));
    await simulating.with('machine');
    expect(requests.begin).toHaveBeenCalledWith('trace', 'machine');
    expect([simulating.shown?.rms, simulating.problem, simulating.busy]).toEqual([[3], null, false]);
    expect(requests.remove).toHaveBeenCalledExactlyOnceWith('a');
  });

  it('that has to wait tells of its job at once', async () => {
    const waiting = job('queued');
    requests.begin.mockResolvedValueOnce(waiting);
    requests.news.mockReturnValueOnce(new Promise<Job>(() => {}));
    void simulating.with('machine');
    await vi.waitFor(() => expect(simulating.job).toBe(waiting));
  });

  it('that failed says why, and its job does not keep the trace from being deleted', async () => {
    requests.news.mockResolvedValueOnce(job('failed', 'the trace has no gains'));
    await simulating.with('machine');
    expect([simulating.shown, simulating.problem?.detail]).toEqual([null, 'the trace has no gains']);
    expect(requests.remove).toHaveBeenCalledExactlyOnceWith('a');
  });

  it('is shown, and its failure told, though the job could not be taken away', async () => {
    requests.remove.mockRejectedValue(new Error('no answer'));
    await simulating.with('machine');
    expect([simulating.shown?.rms, simulating.problem]).toEqual([[3], null]);
    requests.news.mockResolvedValueOnce(job('failed', 'the trace has no gains'));
    await simulating.with('machine');
    expect(simulating.problem?.detail).toBe('the trace has no gains');
  });
});
