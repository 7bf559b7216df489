"""What every command is asked: which config, which run folder, how much to say."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from walkerlab.cli.console import Console
from walkerlab.config.loader import LoadedConfig, Template, template
from walkerlab.config.schema import Config
from walkerlab.store.runfolder import RunFolder


@dataclass(frozen=True)
class Request:
    """The options that every command has.

    config   file or built-in name; None is the built-in paper config
    sets     `--set` options
    strides  `--strides`, or None
    runs     the folder of all runs
    """

    config: Path | None
    sets: tuple[str, ...] = ()
    strides: int | None = None
    runs: Path = Path("runs")
    as_json: bool = False
    quiet: bool = False
    verbose: bool = False

    @cached_property
    def console(self) -> Console:
        """Where messages go."""
        return Console(self.quiet, self.verbose)

    @cached_property
    def template(self) -> Template:
        """The config, ready to be varied, its warnings said; ConfigError if it is not usable."""
        read = template(self.config, self.sets, self.strides)
        loaded = read.base
        if loaded.config.stability.cases:
            from walkerlab.verification.catalogue import judged

            judged(loaded.config.stability.cases)
        for warning in loaded.warnings:
            self.console.warn(warning)
        self.console.detail(f"config: {loaded.source}; run folder: {self.runs / loaded.run_name}")
        return read

    @property
    def loaded(self) -> LoadedConfig:
        """The config as it is."""
        return self.template.base

    @property
    def resolved(self) -> Config:
        """The config itself."""
        return self.loaded.config

    @property
    def folder(self) -> RunFolder:
        """The run's folder."""
        return RunFolder(self.runs, self.loaded.run_name)
