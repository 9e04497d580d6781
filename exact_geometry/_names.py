"""The names `engine` and `service` where a wheel is installed: those of another package, if there is one, else ours.

In the wheel this file stands at the top, as `_exact_geometry_names`, and a .pth file imports it when Python starts. It
imports nothing itself, and its finder comes last: a package of another project with such a name is imported in place of
ours, whichever is installed first, and neither touches files of the other. Ours are the modules of `exact_geometry`.
"""

import sys


class Names:
    """Finds `exact_geometry.engine` and `exact_geometry.service` under their plain names."""

    def __init__(self, inner):  # type: ignore[no-untyped-def]
        self.inner = inner

    def find_spec(self, name, path=None, target=None):  # type: ignore[no-untyped-def]
        """Return the spec of one of these modules: of what is within, if that is the part of this finder."""
        top, dot, within = name.partition(".")
        if top not in ("engine", "service") or bool(dot) != self.inner:
            return None
        from importlib.machinery import ModuleSpec
        from importlib.util import find_spec, spec_from_file_location

        if dot and sys.modules.get(top) is not sys.modules.get("exact_geometry." + top, self):
            return None
        ours = find_spec("exact_geometry." + name) if dot or find_spec("exact_geometry") else None
        if ours is None or within == "__main__":
            return ours and spec_from_file_location(name, ours.origin)
        if not dot:
            sys.meta_path.insert(0, Names(True))
        spec = ModuleSpec(name, Same("exact_geometry." + name), origin=ours.origin)  # type: ignore[arg-type]
        spec.submodule_search_locations = ours.submodule_search_locations
        return spec


class Same:
    """Loads a module as the one with the longer name."""

    def __init__(self, name):  # type: ignore[no-untyped-def]
        self.name = name

    def create_module(self, spec):  # type: ignore[no-untyped-def]
        """Return the module with the longer name."""
        from importlib import import_module

        module = import_module(self.name)
        self.spec = module.__spec__
        return module

    def exec_module(self, module):  # type: ignore[no-untyped-def]
        """Leave the module as it was."""
        module.__spec__ = self.spec


if __name__ == "_exact_geometry_names":
    sys.meta_path.append(Names(False))
