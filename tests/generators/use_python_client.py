"""Uses the client that openapi-python-client has made: a mesh, a projection and a refusal.

This program runs in the environment of the generators; its folder has the generated package
`client`. The arguments are the URL of a service and a key. It prints a report as JSON.
"""

import json
import sys

from client import AuthenticatedClient
from client.api.meshes import create_mesh, get_surface_mesh
from client.api.queries import project_points
from client.models import (
    BezierDefinition,
    ClosestPoints,
    GetSurfaceMeshOverlaysItem,
    GetSurfaceMeshSuffix,
    Mesh,
    MeshRequest,
    Problem,
    ProjectRequest,
)

BOWL = BezierDefinition(
    control_net=[
        [[0, 0, 1], [0, 0.5, 0], [0, 1, 1]],
        [[0.5, 0, 0], [0.5, 0.5, -1], [0.5, 1, 0]],
        [[1, 0, 1], [1, 0.5, 0], [1, 1, 1]],
    ]
)

service = AuthenticatedClient(base_url=sys.argv[1], token=sys.argv[2])
mesh = create_mesh.sync(client=service, body=MeshRequest(surface=BOWL, resolution=[2, 3]))
assert isinstance(mesh, Mesh)
by_url = get_surface_mesh.sync(
    "saddle",
    GetSurfaceMeshSuffix.JSON,
    client=service,
    resolution=[2, 3],
    overlays=[GetSurfaceMeshOverlaysItem.CONTROL_NET, GetSurfaceMeshOverlaysItem.BOUNDARY],
)
assert isinstance(by_url, Mesh)
body = ProjectRequest(surface=BOWL, points=[[0.5, 0.5, 1]])
projection = project_points.sync(client=service, body=body)
assert isinstance(projection, ClosestPoints)
refusal = create_mesh.sync_detailed(client=service, body=MeshRequest(surface=BOWL, resolution=0))
assert isinstance(refusal.parsed, Problem)
report = {
    "kind": "openapi-python-client",
    "vertices": len(mesh.vertices),
    "triangles": mesh.report.triangles,
    "byUrl": by_url.report.triangles,
    "distance": projection.distances[0],
    "status": refusal.status_code,
    "code": refusal.parsed.errors[0].code,
    "pointer": refusal.parsed.errors[0].pointer,
}
print(json.dumps(report))
