/** What people ask for, as the audit log has it, in words: the names of operations are for programs. Pure. */

const WORDS: Readonly<Record<string, string>> = {
  create_ticket: 'open the live view',
  attend_queue: 'confirm being at the arm',
  renew_control: 'keep control',
  submit_experiment: 'add an experiment',
  submit_job: 'begin a computation',
  jog_robot: 'jog',
  upload_trace: 'take in a trace',
  upload_model: 'take in a model',
};

/** `delete trace`, `open the live view`. */
export function actionWords(action: string): string {
  return WORDS[action] ?? action.replaceAll('_', ' ');
}
