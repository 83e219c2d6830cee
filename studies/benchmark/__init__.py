"""The benchmark push-n: its entries, and how learners are entered."""
