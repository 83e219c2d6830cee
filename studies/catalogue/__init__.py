"""The studies: what is measured of trials, how it is compared, drawn and reported."""
