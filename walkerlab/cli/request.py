"""What every command is asked: which config, which run folder, how much to say."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from walkerlab.cli.console import Console
from walkerlab.cli.options import typed_options
from walkerlab.config.loader import LoadedConfig, Template
from walkerlab.config.schema import Config
from walkerlab.stages.resolve import Asked, resolve
from walkerlab.store.runfolder import RunFolder


@dataclass(frozen=True)
class Request:
    """The options that every command has.

    config   what `resolve` takes: file, built-in name or run; None is the built-in paper config
    sets     `--set` options
    strides  `--strides`, or None
    runs     the folder of all runs
    """

    config: str | None
    sets: tuple[str, ...] = ()
    strides: int | None = None
    runs: Path = Path("runs")
    as_json: bool = False
    quiet: bool = False
    verbose: bool = False
    open_page: bool = False

    @cached_property
    def console(self) -> Console:
        """Where messages go."""
        return Console(self.quiet, self.verbose, self.open_page)

    @property
    def typed(self) -> str:
        """The options that say which run it is, as they can be typed again."""
        return typed_options(self.config, self.sets, self.strides, self.runs)

    @cached_property
    def asked(self) -> Asked:
        """The config and its run folder, its warnings said; ConfigError if it is not usable."""
        found = resolve(self.config, self.sets, self.strides, self.runs)
        loaded = found.template.base
        if loaded.config.stability.cases:
            from walkerlab.verification.catalogue import judged

            judged(loaded.config.stability.cases)
        for warning in loaded.warnings:
            self.console.warn(warning)
        self.console.detail(f"config: {loaded.source}; run folder: {found.folder.path}")
        return found

    @property
    def template(self) -> Template:
        """The config, ready to be varied."""
        return self.asked.template

    @property
    def loaded(self) -> LoadedConfig:
        """The config as it is."""
        return self.asked.template.base

    @property
    def resolved(self) -> Config:
        """The config itself."""
        return self.loaded.config

    @property
    def folder(self) -> RunFolder:
        """The run's folder."""
        return self.asked.folder
