"""Off-screen pictures and films of posed bodies, on the CPU: needs the extra ``[render]``."""
