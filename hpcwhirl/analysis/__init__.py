"""Reading motion: whirl (Eq. 12), spectra, regimes, critical speeds (Eq. 13)."""
