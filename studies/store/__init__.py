"""The ledger of a study: nothing that was finished is lost."""
