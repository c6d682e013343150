"""Holds files (JSON, JSON Lines or TOML) against a JSON schema: schema.py SCHEMA FILE...

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


def documents(path):
    """The documents of a file, each with its place."""
    if path.endswith(".toml"):
        with open(path, "rb") as file:
            yield path, tomllib.load(file)
        return
    with open(path, encoding="utf-8") as file:
        if path.endswith(".jsonl"):
            for number, line in enumerate(file, 1):
                yield f"{path}:{number}", json.loads(line)
        else:
            yield path, json.load(file)


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        schema = json.load(file)
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(closed(schema))
    bad = False
    for path in sys.argv[2:]:
        for name, document in documents(path):
            for error in validator.iter_errors(document):
                bad = True
                place = "/".join(str(word) for word in error.absolute_path)
                print(f"{name}: {place}: {error.message[:300]}", file=sys.stderr)
    sys.exit(bad)


main()
