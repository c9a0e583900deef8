"""Who gets memory and a thread, when, and until when."""
