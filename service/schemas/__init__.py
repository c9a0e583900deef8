"""The JSON language: documents in, frozen values out. The only place where lists become arrays."""
