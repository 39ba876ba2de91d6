"""Tables, figures, Excel and HTML from the results of a study.

A `teller.Teller` for each kind of answer makes a `document.Document` of sentences (`templates`), tables (`columns`)
and figures (`figure`); `writer` makes page, workbook and pictures of it, `folder` puts them where nothing is lost. A
`portrait.Portrait` says and shows more of one kind of model.
"""
