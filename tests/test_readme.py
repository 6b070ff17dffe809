"""What the README tells to type has to work."""

import re
import tomllib
from pathlib import Path

from gateway.configuration.config import from_document

README = (Path(__file__).parents[1] / "README.md").read_text("utf-8")


def test_configuration_in_the_readme_is_valid() -> None:
    [text] = re.findall(r"```toml\n(.*?)```", README, flags=re.DOTALL)
    config = from_document(tomllib.loads(text))
    assert config.truck.total_mass == 3640.0


def test_every_link_in_the_readme_leads_to_a_file() -> None:
    links = re.findall(r"\]\(([^)#:]+)\)", README)
    assert links
    assert all((Path(__file__).parents[1] / link).is_file() for link in links)
