"""`surface sign`: signs a URL, which any client may then read; does not need the service."""

import argparse

from service.cli.output import print_lines
from service.cli.refusals import EXIT_CODES, OK, UsageError
from service.cli.source import Commands


def add(commands: Commands) -> None:
    """Adds the command and its flags."""
    sign = commands.add_parser(
        "sign",
        help="sign a URL of a private surface",
        description="Signs with the first secret of SURFACE_SIGNING_KEYS and prints the URL, "
        "which is valid at every service with that secret. It sends no request to a service.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    sign.add_argument(
        "path",
        metavar="URL",
        help="surface or mesh, without the host: /v1/surfaces/ID/mesh.glb?engine=4",
    )
    expiry = sign.add_mutually_exclusive_group(required=True)
    expiry.add_argument("--seconds", metavar="N", help="seconds from now until it expires")
    expiry.add_argument("--expires", metavar="UNIXTIME", help="when it expires, in Unix time")
    sign.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> int:
    import time

    from service.api.guard.guard import build_signer
    from service.api.guard.signatures import build_signed_url
    from service.schemas.request import SignRequest
    from service.schemas.validation import validate_document
    from service.settings.environment import read_environment

    signer = build_signer(read_environment())
    if signer is None:
        raise UsageError("SURFACE_SIGNING_KEYS: got nothing, needed a secret to sign with")
    document: dict[str, object] = {"url": arguments.path}
    for name in ("seconds", "expires"):
        text = getattr(arguments, name)
        if text is not None:
            # Valid numbers have fewer than 20 digits; of thousands, `int` raises ValueError.
            if not (text.isascii() and text.isdigit() and len(text) < 20):
                raise UsageError(f"--{name}: needed a whole number")
            document[name] = int(text)
    request = validate_document(SignRequest, document)
    url, _ = build_signed_url(signer, request, root="", now=time.time())
    print_lines([url])
    return OK
