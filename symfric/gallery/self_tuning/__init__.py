"""Paper on a continuously differentiable, self-tuning friction law, doi
10.1177/14644193231169325.

The available text lacks authors, title, equations and tables; the law is the reconstruction of
`SelfTuning`, the machines are Haug's examples. The text has no curves either, so each figure is
compared with the statements of the text, and with independent computations.
"""
