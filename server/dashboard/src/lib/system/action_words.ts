/** What people ask for, as the audit log has it, in words: the names of operations are for programs. Pure. */

const WORDS: Readonly<Record<string, string>> = {
  create_ticket: 'open the live view',
  attend_queue: 'confirm being at the arm',
  renew_control: 'keep control',
  submit_experiment: 'add an experiment',
  submit_job: 'begin a computation',
  jog_robot: 'jog',
  upload_trace: 'take in a trace',
  create_schedule: 'plan',
  change_schedule: 'switch in the plan',
  delete_schedule: 'delete from the plan',
  upload_model: 'take in a model',
  put_layouts: 'show or save a layout',
  put_macro_: 'save a macro',
  put_program: 'save a program',
  read_macro: 'check a macro',
  read_kept_macro: 'check a macro',
  read_console_line: 'check a line of the console',
  hide_effect: 'hide something in the mock',
  change_trace: 'note on a trace',
  give_control_back: 'release control',
  rows_left_out: 'rows left out',
  start_service: 'the service began',
};

/** `delete trace`, `open the live view`. */
export function actionWords(action: string): string {
  return WORDS[action] ?? action.replaceAll('_', ' ');
}
