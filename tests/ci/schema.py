"""Holds files (JSON or TOML) against a JSON schema: schema.py SCHEMA FILE...

Objects may have no key that the schema does not name: what is not described would otherwise go unseen.
"""

import json
import sys
import tomllib

from jsonschema import Draft202012Validator


def closed(schema):
    """The schema with every object closed to keys that it does not name."""
    if isinstance(schema, list):
        return [closed(element) for element in schema]
    if not isinstance(schema, dict):
        return schema
    result = {key: closed(value) for key, value in schema.items()}
    if isinstance(schema.get("properties"), dict) and "type" in schema:
        result.setdefault("additionalProperties", False)
    return result


def read(path):
    if path.endswith(".toml"):
        with open(path, "rb") as file:
            return tomllib.load(file)
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        schema = json.load(file)
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(closed(schema))
    bad = False
    for path in sys.argv[2:]:
        for error in validator.iter_errors(read(path)):
            bad = True
            place = "/".join(str(word) for word in error.absolute_path)
            print(f"{path}: {place}: {error.message[:300]}", file=sys.stderr)
    sys.exit(bad)


main()
