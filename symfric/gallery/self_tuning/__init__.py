"""The paper of a continuously differentiable, self-tuning friction law, doi
10.1177/14644193231169325.

Its authors, title, equations and tables are lost in the text that we have; the law is the
reconstruction of `SelfTuning`, the machines are Haug's examples. Its curves cannot be read from
text either, so each figure is compared with what the text says about it, and with answers from
elsewhere.
"""
