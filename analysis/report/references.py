"""What a report refers to."""

REFERENCES = {
    "bt500": (
        "Recommendation ITU-R BT.500: Methodologies for the subjective assessment of the quality "
        "of television images."
    ),
    "bt1788": (
        "Recommendation ITU-R BT.1788: Methodology for the subjective assessment of video quality "
        "in multimedia applications."
    ),
    "p910": (
        "Recommendations ITU-T P.910 (Annex E) and P.913 (12.4, 12.6): Subjective video quality "
        "assessment methods."
    ),
    "seybold": (
        "T. Seybold, \u00d6. Cakmak, C. Keimel, W. Stechele: Noise characteristics of a single "
        "sensor camera in digital color image processing. Color and Imaging Conference 22, 2014."
    ),
    "clopper": (
        "C. J. Clopper, E. S. Pearson: The use of confidence or fiducial limits illustrated in "
        "the case of the binomial. Biometrika 26, 1934."
    ),
    "hesterberg": (
        "T. Hesterberg: What teachers should know about the bootstrap. The American Statistician "
        "69(4), 2015."
    ),
    "sos": "T. Ho\u00dffeld, R. Schatz, S. Egger: SOS: the MOS is not enough! QoMEX 2011.",
    "holm": (
        "S. Holm: A simple sequentially rejective multiple test procedure. Scandinavian Journal "
        "of Statistics 6, 1979."
    ),
    "pratt": (
        "J. W. Pratt: Remarks on zeros and ties in the Wilcoxon signed rank procedures. Journal "
        "of the American Statistical Association 54, 1959."
    ),
    "quadrature": (
        "S. Rabe-Hesketh, A. Skrondal, A. Pickles: Maximum likelihood estimation of limited and "
        "discrete dependent variable models with nested random effects. Journal of Econometrics "
        "128, 2005."
    ),
}
