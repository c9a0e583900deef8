"""The alerts as the Prometheus Operator wants them: `python -m tools.deploy.rules` writes the file.

One list of alerts, `deploy/prometheus/alerts.yaml`, is for all; comments stay there.
"""

from typing import Any

import yaml

from tests.deploy.files import DEPLOY, load

SOURCE = DEPLOY / "prometheus" / "alerts.yaml"
FILE = DEPLOY / "kubernetes" / "monitoring" / "rules.yaml"

HEAD = """\
# Made of deploy/prometheus/alerts.yaml by `python -m tools.deploy.rules`; a test compares them.
"""


def rule() -> dict[str, Any]:
    """The manifest."""
    return {
        "apiVersion": "monitoring.coreos.com/v1",
        "kind": "PrometheusRule",
        "metadata": {
            "name": "surface-service",
            "labels": {"app.kubernetes.io/name": "surface-service"},
        },
        "spec": load(SOURCE),
    }


if __name__ == "__main__":
    text = yaml.safe_dump(rule(), sort_keys=False, allow_unicode=True, width=100)
    FILE.write_text(HEAD + text, encoding="utf-8")
