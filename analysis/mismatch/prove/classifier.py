class Auc: value=.5
def auc_of(*a,**k): return None
