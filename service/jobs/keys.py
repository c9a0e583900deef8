"""Keys of everything that jobs keep in the store.

    parts/ab/<id of a part>         its result, for every job that asks for it
    jobs/<id>/job.json              the manifest, written once
    jobs/<id>/state.json            counts of its parts
    jobs/<id>/askers/<caller>       who waits for it
    jobs/<id>/cancelled             there while no caller waits for it
    jobs/<id>/results/<batch>       records of the results of a batch
    files/ab/<hash>.<format>        a file that parts read, as a client sent it
    intake/<folder>/<batch>         lines of the parts of a batch, as they were accepted
    owners/<id>                     which process works on it
    instances/<instance>            that a serving process is alive, written anew every 10 s
    callers/<caller>/<id>           index of the jobs of a caller

Ids are SHA-256 in hexadecimal; names that a client chose are in no key.
"""

from hashlib import sha256

from service.schemas.jobs import FILE_ID
from service.storage.keys import is_id

PARTS, JOBS, INTAKE, CALLERS = "parts", "jobs", "intake", "callers"
OWNERS, INSTANCES, FILES = "owners", "instances", "files"
"""Prefixes of the keys."""


def part_key(id: str) -> str:
    """The key of a part's result: at most 256 folders.

    Raises
    ------
    ValueError
        `id` is not a SHA-256: the last check before a file is opened.
    """
    return f"{PARTS}/{_check(id)[:2]}/{id}"


def file_key(id: str) -> str:
    """The key of a file that parts read.

    Raises
    ------
    ValueError
        `id` is not one of `FILE_ID`: the last check before a file is opened.
    """
    if not FILE_ID.fullmatch(id):
        raise ValueError("the id of a file has 64 hexadecimal digits and the name of a format")
    return f"{FILES}/{id[:2]}/{id}"


def job_key(id: str, name: str) -> str:
    """The key of one of a job's objects, such as `state.json`; raises the error of `part_key`."""
    return f"{JOBS}/{_check(id)}/{name}"


def manifest_key(id: str) -> str:
    """The key of a job's manifest; raises the error of `part_key`."""
    return job_key(id, "job.json")


def state_key(id: str) -> str:
    """The key of a job's state; raises the error of `part_key`."""
    return job_key(id, "state.json")


def cancelled_key(id: str) -> str:
    """The key of the mark that no caller waits for a job; raises the error of `part_key`."""
    return job_key(id, "cancelled")


def asker_key(id: str, caller: str) -> str:
    """The key of one who waits for a job; raises the error of `part_key`."""
    return job_key(id, f"askers/{caller_hash(caller)}")


def results_key(id: str, batch: int) -> str:
    """The key of the records of a batch's results; raises the error of `part_key`."""
    return job_key(id, f"results/{batch:06}")


def intake_key(folder: str, batch: int) -> str:
    """The key of the lines of a batch."""
    return f"{INTAKE}/{folder}/{batch:06}"


def owner_key(id: str) -> str:
    """The key of the process that works on a job; raises the error of `part_key`."""
    return f"{OWNERS}/{_check(id)}"


def instance_key(instance: str) -> str:
    """The key of the sign of life of a serving process."""
    return f"{INSTANCES}/{instance}"


def caller_key(caller: str, id: str) -> str:
    """The key of a job in the index of a caller; raises the error of `part_key`."""
    return f"{CALLERS}/{caller_hash(caller)}/{_check(id)}"


def caller_hash(caller: str) -> str:
    """The SHA-256 of a caller's name: a name or an address is no safe part of a key."""
    return sha256(caller.encode()).hexdigest()


def _check(id: str) -> str:
    if not is_id(id):
        raise ValueError("an id has 64 hexadecimal digits")
    return id
