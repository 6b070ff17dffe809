"""Certificates of PLCs and gateways by two authorities, made anew for a test."""

import ssl
import subprocess
from pathlib import Path


def certificates(folder: Path, openssl: str) -> Path:
    """Two authorities, `plant` and `other`; from each a certificate of a PLC and of a gateway."""

    def run(*words: str) -> None:
        subprocess.run([openssl, *words], cwd=folder, check=True, capture_output=True)

    curve = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")
    for authority in ("plant", "other"):
        own = (f"{authority}.pem", f"{authority}.key")
        run("req", "-x509", *curve, "-out", own[0], "-keyout", own[1], "-subj", f"/CN={authority}")
        for name, alternative in (("plc", "IP:127.0.0.1"), ("gateway", "DNS:gateway")):
            stem = f"{authority}_{name}"
            run(
                *("req", "-x509", *curve, "-CA", own[0], "-CAkey", own[1], "-subj", f"/CN={name}"),
                *("-addext", f"subjectAltName={alternative}"),
                *("-addext", "basicConstraints=critical,CA:FALSE"),
                *("-out", f"{stem}.pem", "-keyout", f"{stem}.key"),
            )
    return folder


def server_context(folder: Path) -> ssl.SSLContext:
    """Context of a PLC of `plant` that wants a certificate of `plant`."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(folder / "plant_plc.pem", folder / "plant_plc.key")
    context.load_verify_locations(folder / "plant.pem")
    context.verify_mode = ssl.CERT_REQUIRED
    return context
