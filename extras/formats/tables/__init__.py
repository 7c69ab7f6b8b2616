"""Tables of other programs: Parquet, data sets of lerobot, MATLAB's .mat, NumPy's .npz, JSON."""

from daq.plugins import Importer, Plugin

PLUGIN = Plugin(
    importers=(
        Importer(
            "the table in it",
            "extras.formats.tables.table_files:is_table",
            "extras.formats.tables.table_files:import_table",
        ),
    )
)
