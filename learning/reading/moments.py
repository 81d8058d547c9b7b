"""Moments, written as ISO 8601 has it."""

import polars as pl

ZONED = "%Y-%m-%dT%H:%M:%S%.f%#z"
OTHERS = (
    "%Y-%m-%dT%H:%M:%S%.f",
    "%Y-%m-%dT%H:%M%#z",
    "%Y-%m-%dT%H:%M",
    "%Y-%m-%d",
)
MICROSECONDS = 1e6


def seconds(moment: pl.Expr, type_: pl.DataType) -> pl.Expr:
    """Return seconds since 1970 of moments or of texts, null where one is none.

    Without a zone they are in UTC.
    """
    if isinstance(type_, pl.Datetime | pl.Date):
        return moment.cast(pl.Datetime("us")).dt.epoch("us") / MICROSECONDS
    return moment.cast(pl.String).map_batches(
        _of_texts, pl.Float64, is_elementwise=True
    )


def _of_texts(texts: pl.Series) -> pl.Series:
    """Try form by form, as long as there are texts of none of them."""
    found = _of_form(texts, ZONED)
    if found.null_count() > texts.null_count():
        texts = texts.str.replace(" ", "T", literal=True)
        for form in (ZONED, *OTHERS):
            found = found.zip_with(found.is_not_null(), _of_form(texts, form))
            if found.null_count() == texts.null_count():
                break
    return found


def _of_form(texts: pl.Series, form: str) -> pl.Series:
    moments = texts.str.to_datetime(form, time_unit="us", strict=False)
    return moments.dt.epoch("us") / MICROSECONDS
