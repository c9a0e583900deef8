// The error of a file or a text that the page does not read.

/** @typedef {import('surface-service').Issue} Issue */

/** The page cannot read a file or a text. */
export class Unreadable extends Error {
  /** @param {Issue} issue */
  constructor(issue) {
    super(issue.detail);
    /** As those of a refusal of the service. */
    this.errors = [issue];
  }
}
